#pragma once

#include <farfield/core/executor.hpp>

#include <memory>

namespace farfield::parallel {

/// Runs tasks on several cores with oneTBB.
class ParallelExecutor final : public Executor {
  public:
    /// @param threads that work at most, the caller's included; 0: one for every core
    explicit ParallelExecutor(unsigned threads = 0);
    ~ParallelExecutor() override;

    void run(std::size_t count, const std::function<void(std::size_t)>& task) override;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::parallel
