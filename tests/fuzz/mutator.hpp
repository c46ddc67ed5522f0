#pragma once

#include "io/file_bytes.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <random>
#include <string>

namespace farfield::support {

/// Damages bytes at random, as files are damaged and as an attacker would.
class Mutator {
  public:
    explicit Mutator(std::uint32_t seed) : random_(seed) {}

    std::size_t below(std::size_t limit) { return random_() % limit; }

    std::string mutate(std::string bytes) {
        for (std::size_t step = 1 + below(3); step-- > 0;) {
            const std::size_t at = below(bytes.size() + 1);
            const std::size_t length = std::min(1 + below(16), bytes.size() - at);
            const std::size_t other = below(bytes.size() + 1);
            switch (below(7)) {
            case 0:
                if (at < bytes.size()) {
                    bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
                }
                break;
            case 1:
                if (at < bytes.size()) {
                    bytes[at] = static_cast<char>(below(256));
                }
                break;
            case 2:
                bytes.erase(at, length);
                break;
            case 3: // a piece of it elsewhere
                bytes.insert(at, bytes.substr(other, length));
                break;
            case 4:
                bytes.replace(at, length, bytes.substr(other, length));
                break;
            case 5: // numbers at the edges, at a whole place
                if (at + 8 <= bytes.size()) {
                    put(bytes, at / 4 * 4, number());
                }
                break;
            default:
                if (below(8) == 0) {
                    bytes.resize(std::max<std::size_t>(at, 1));
                }
                break;
            }
        }
        return bytes;
    }

  private:
    std::uint32_t number() {
        constexpr std::uint32_t kNumbers[] = {
            0,
            1,
            2,
            0x7FFFFFFF,
            0x80000000,
            0x80000001,
            0xFFFFFFFF,
            0x7F800000,
            0x7FC00000,
            0x00000001};
        return kNumbers[below(std::size(kNumbers))];
    }

    std::mt19937 random_;
};

} // namespace farfield::support
