#pragma once

#include <farfield/core/executor.hpp>

#include <atomic>
#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

namespace farfield::support {

/// Runs tasks on new threads, whatever the number of cores, each taking the next one that is left:
/// they end in another order on every run.
class ThreadExecutor final : public Executor {
  public:
    explicit ThreadExecutor(unsigned threads) : threads_(threads) {}

    void run(std::size_t count, const std::function<void(std::size_t)>& task) override {
        std::atomic<std::size_t> next{0};
        std::vector<std::thread> workers;
        for (unsigned i = 0; i < threads_; ++i) {
            workers.emplace_back([&] {
                for (std::size_t k = next++; k < count; k = next++) {
                    task(k);
                }
            });
        }
        for (std::thread& worker : workers) {
            worker.join();
        }
    }

  private:
    unsigned threads_;
};

} // namespace farfield::support
