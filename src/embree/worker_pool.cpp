#include "embree/worker_pool.hpp"

namespace farfield::embree {

namespace {

/// Looks for a job before sleeping: about 20 microseconds, the time that waking a thread takes.
constexpr int kLooks = 20000;

/// Waits until `value` is no longer `old`.
void wait_while(const std::atomic<std::uint32_t>& value, std::uint32_t old) noexcept {
    for (int look = 0; look < kLooks; ++look) {
        if (value.load(std::memory_order_acquire) != old) {
            return;
        }
    }
    value.wait(old, std::memory_order_acquire);
}

} // namespace

WorkerPool::WorkerPool(unsigned threads) {
    workers_.reserve(threads - 1);
    for (unsigned thread = 1; thread < threads; ++thread) {
        workers_.emplace_back([this, thread] { serve(thread); });
    }
}

WorkerPool::~WorkerPool() {
    ending_.store(true, std::memory_order_relaxed);
    job_.fetch_add(1, std::memory_order_release);
    job_.notify_all();
    for (std::thread& worker : workers_) {
        worker.join();
    }
}

void WorkerPool::run_job(std::uint32_t tasks, const void* context, Call call) noexcept {
    tasks_ = tasks;
    context_ = context;
    call_ = call;
    next_.store(0, std::memory_order_relaxed);
    // One task is not worth waking anybody for.
    const bool shared = tasks > 1 && !workers_.empty();
    if (shared) {
        serving_.store(static_cast<std::uint32_t>(workers_.size()), std::memory_order_relaxed);
        job_.fetch_add(1, std::memory_order_release);
        job_.notify_all();
    }
    take_tasks(0);
    if (shared) {
        for (std::uint32_t left = serving_.load(std::memory_order_acquire); left != 0;
             left = serving_.load(std::memory_order_acquire)) {
            wait_while(serving_, left);
        }
    }
}

void WorkerPool::take_tasks(unsigned thread) noexcept {
    for (std::uint32_t task = next_.fetch_add(1, std::memory_order_relaxed); task < tasks_;
         task = next_.fetch_add(1, std::memory_order_relaxed)) {
        call_(context_, task, thread);
    }
}

void WorkerPool::serve(unsigned thread) noexcept {
    std::uint32_t seen = 0;
    for (;;) {
        wait_while(job_, seen);
        ++seen;
        if (ending_.load(std::memory_order_relaxed)) {
            return;
        }
        take_tasks(thread);
        if (serving_.fetch_sub(1, std::memory_order_acq_rel) == 1) {
            serving_.notify_one();
        }
    }
}

} // namespace farfield::embree
