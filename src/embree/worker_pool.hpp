#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace farfield::embree {

/// Threads that share out numbered tasks, the caller's among them. Between jobs they look for the
/// next one for a moment before they sleep: a frame is many short jobs in a row.
class WorkerPool {
  public:
    /// @param threads that work, the caller's included; >= 1
    explicit WorkerPool(unsigned threads);
    WorkerPool(const WorkerPool&) = delete;
    WorkerPool& operator=(const WorkerPool&) = delete;
    ~WorkerPool();

    /// Calls `work(task, thread)` for every task below `tasks`, and returns when all are done.
    /// Tasks start in order; a thread has one at a time. Nothing is allocated.
    template <typename Work>
    void run(std::uint32_t tasks, const Work& work) noexcept {
        run_job(tasks, &work, [](const void* context, std::uint32_t task, unsigned thread) {
            (*static_cast<const Work*>(context))(task, thread);
        });
    }

    [[nodiscard]] unsigned threads() const noexcept {
        return static_cast<unsigned>(workers_.size()) + 1;
    }

  private:
    using Call = void (*)(const void* context, std::uint32_t task, unsigned thread);

    void run_job(std::uint32_t tasks, const void* context, Call call) noexcept;
    void take_tasks(unsigned thread) noexcept;
    void serve(unsigned thread) noexcept;

    std::vector<std::thread> workers_;
    std::atomic<std::uint32_t> job_{0};     ///< counts jobs; a change wakes the workers
    std::atomic<std::uint32_t> next_{0};    ///< task to start next
    std::atomic<std::uint32_t> serving_{0}; ///< workers that have not finished with this job
    std::atomic<bool> ending_{false};
    std::uint32_t tasks_ = 0;
    const void* context_ = nullptr;
    Call call_ = nullptr;
};

} // namespace farfield::embree
