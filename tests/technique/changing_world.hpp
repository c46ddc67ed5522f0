#pragma once

#include "support/random.hpp"
#include "technique/scenes.hpp"
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>

namespace farfield::support {

enum class Partition : std::uint8_t { bsp, kdtree, octree };

/// The objects of a forest, cut another way.
[[nodiscard]] Hierarchy build(const Forest& forest, Partition partition);

/// What happens to the trees of a forest, at random and the same for the same seed: they look
/// different, move, rest, vanish and come back, and the light changes.
class ChangingWorld {
  public:
    /// @param tree of the objects of `forest`; both must outlive this
    ChangingWorld(Hierarchy& tree, const Forest& forest, std::uint64_t seed);

    /// What happens between two frames. Allocates nothing.
    void step();

    /// Every tree back to where it was at first.
    void restore();

    /// For `ImageCache::set_appearance`.
    [[nodiscard]] std::uint64_t appearance() const { return appearance_; }

  private:
    void move(ItemId item);
    void send_home(ItemId item);
    [[nodiscard]] std::uint32_t trees() const;

    Hierarchy* tree_;
    const Forest* forest_;
    Hierarchy start_;
    Random random_;
    std::uint64_t appearance_ = 0;
};

} // namespace farfield::support
