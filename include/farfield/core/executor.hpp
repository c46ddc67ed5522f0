#pragma once

#include <cstddef>
#include <functional>

namespace farfield {

/// How builders run what can be done at the same time. What they build does not depend on it.
class Executor {
  public:
    Executor() = default;
    Executor(const Executor&) = delete;
    Executor& operator=(const Executor&) = delete;
    virtual ~Executor() = default;

    /// Calls `task(i)` once for every i in [0, count), in any order and perhaps at the same time,
    /// and returns when all calls have.
    virtual void run(std::size_t count, const std::function<void(std::size_t)>& task) = 0;
};

/// One after the other on the calling thread.
class SerialExecutor final : public Executor {
  public:
    void run(std::size_t count, const std::function<void(std::size_t)>& task) override {
        for (std::size_t i = 0; i < count; ++i) {
            task(i);
        }
    }
};

} // namespace farfield
