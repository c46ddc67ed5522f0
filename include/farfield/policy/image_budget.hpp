#pragma once

#include <cstdint>
#include <vector>

namespace farfield {

/// A hard limit on bytes: what would not fit is not taken.
class ImageBudget {
  public:
    explicit ImageBudget(std::uint64_t limit_bytes) noexcept : limit_bytes_(limit_bytes) {}

    /// Takes `bytes`, or takes nothing and says no.
    [[nodiscard]] bool take(std::uint64_t bytes) noexcept {
        if (bytes > limit_bytes_ - used_bytes_) {
            return false;
        }
        used_bytes_ += bytes;
        peak_bytes_ = used_bytes_ > peak_bytes_ ? used_bytes_ : peak_bytes_;
        return true;
    }

    /// Gives back what was taken. @pre bytes <= used_bytes()
    void give_back(std::uint64_t bytes) noexcept { used_bytes_ -= bytes; }

    [[nodiscard]] std::uint64_t limit_bytes() const noexcept { return limit_bytes_; }
    [[nodiscard]] std::uint64_t used_bytes() const noexcept { return used_bytes_; }
    [[nodiscard]] std::uint64_t peak_bytes() const noexcept { return peak_bytes_; }

  private:
    std::uint64_t limit_bytes_ = 0;
    std::uint64_t used_bytes_ = 0;
    std::uint64_t peak_bytes_ = 0;
};

/// Order of last use of things numbered 0, 1, ...: a doubly linked list in two flat arrays. Every
/// operation takes constant time.
class RecencyList {
  public:
    static constexpr std::uint32_t kNothing = UINT32_MAX;

    RecencyList() { links_.push_back({0, 0}); }

    /// Puts an entry behind all others; adds it when it is not in the list.
    void touch(std::uint32_t entry) {
        const std::uint32_t link = entry + 1;
        if (link >= links_.size()) {
            links_.resize(std::size_t{link} + 1);
        }
        unlink(link);
        links_[link] = {links_[0].before, 0};
        links_[links_[0].before].after = link;
        links_[0].before = link;
    }

    /// Takes an entry out; nothing happens when it is not in.
    void remove(std::uint32_t entry) noexcept {
        const std::uint32_t link = entry + 1;
        if (link < links_.size()) {
            unlink(link);
        }
    }

    /// The entry whose last `touch` is longest ago, or `kNothing`.
    [[nodiscard]] std::uint32_t oldest() const noexcept {
        return links_[0].after == 0 ? kNothing : links_[0].after - 1;
    }

    /// Prepares for entries below `count`, so that `touch` does not allocate.
    void reserve(std::uint32_t count) { links_.reserve(std::size_t{count} + 1); }

  private:
    struct Link {
        std::uint32_t before = kNothing; ///< kNothing: not in the list; link 0 is its two ends
        std::uint32_t after = kNothing;
    };

    void unlink(std::uint32_t link) noexcept {
        const Link old = links_[link];
        if (old.before == kNothing) {
            return;
        }
        links_[old.before].after = old.after;
        links_[old.after].before = old.before;
        links_[link] = {};
    }

    std::vector<Link> links_;
};

} // namespace farfield
