#include <farfield/parallel/parallel_executor.hpp>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace farfield::parallel {

struct ParallelExecutor::Impl {
    tbb::task_arena arena;
};

ParallelExecutor::ParallelExecutor(unsigned threads)
    : impl_(std::make_unique<Impl>(Impl{
          tbb::task_arena(threads == 0 ? tbb::task_arena::automatic : static_cast<int>(threads))})
      ) {}

ParallelExecutor::~ParallelExecutor() = default;

void ParallelExecutor::run(std::size_t count, const std::function<void(std::size_t)>& task) {
    impl_->arena.execute([&] {
        // One task at a time: those of builders are long and of uneven length.
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, count, 1),
            [&](const tbb::blocked_range<std::size_t>& range) {
                for (std::size_t i = range.begin(); i < range.end(); ++i) {
                    task(i);
                }
            },
            tbb::simple_partitioner()
        );
    });
}

} // namespace farfield::parallel
