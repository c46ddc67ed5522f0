#include <farfield/parallel/parallel_executor.hpp>

#include <atomic>

int main() {
    farfield::parallel::ParallelExecutor executor;
    std::atomic<int> calls{0};
    executor.run(4, [&](std::size_t) { ++calls; });
    return calls.load() == 4 ? 0 : 1;
}
