#include <farfield/core/executor.hpp>
#include <farfield/parallel/parallel_executor.hpp>

#include <catch2/catch.hpp>

#include <atomic>
#include <cstddef>
#include <vector>

using namespace farfield;

namespace {

void check_each_once(Executor& executor, std::size_t count) {
    std::vector<std::atomic<int>> calls(count);
    executor.run(count, [&](std::size_t i) { ++calls[i]; });
    for (const std::atomic<int>& times : calls) {
        REQUIRE(times.load() == 1);
    }
}

} // namespace

TEST_CASE("every task runs once", "[executor]") {
    for (const std::size_t count : {0U, 1U, 2U, 1000U}) {
        SerialExecutor serial;
        check_each_once(serial, count);
        for (const unsigned threads : {0U, 1U, 2U, 7U}) {
            parallel::ParallelExecutor executor(threads);
            check_each_once(executor, count);
        }
    }
}

TEST_CASE("a task may run others", "[executor]") {
    parallel::ParallelExecutor executor(2);
    std::atomic<int> calls{0};
    executor.run(8, [&](std::size_t) { executor.run(8, [&](std::size_t) { ++calls; }); });
    REQUIRE(calls.load() == 64);
}
