#pragma once

#include "metric/batch_kernels.hpp"
#include "metric/pack.hpp"
#include <farfield/metric/detail/box_terms.hpp>

#if defined(FARFIELD_HAS_PACKS)

/// The loops themselves, for any pack. What is called here must have the pack in its name (see
/// `Pack`): code that other units share might be taken from the unit of a machine that is not here.
namespace farfield::metric::detail {

template <typename T, int kBytes>
[[nodiscard]] Triple<Pack<T, kBytes>>
load_triple(const T* const* columns, std::size_t at) noexcept {
    using Number = Pack<T, kBytes>;
    return {
        Number::load(columns[0] + at),
        Number::load(columns[1] + at),
        Number::load(columns[2] + at)};
}

template <typename T, int kBytes>
[[nodiscard]] Triple<Pack<T, kBytes>> broadcast(const T* const* columns) noexcept {
    using Number = Pack<T, kBytes>;
    return {Number(*columns[0]), Number(*columns[1]), Number(*columns[2])};
}

template <typename T, int kBytes>
[[nodiscard]] ImageTerms<Pack<T, kBytes>>
load_image(const BatchInput<T>& input, std::size_t at) noexcept {
    const auto viewer = broadcast<T, kBytes>(input.viewer);
    const auto points = [&](int column) {
        return input.one_image ? broadcast<T, kBytes>(input.image + column)
                               : load_triple<T, kBytes>(input.image + column, at);
    };
    const auto viewpoint = points(0);
    return image_terms(viewpoint, points(3), points(6), viewer, viewer - viewpoint);
}

/// The last few elements of each column, filled up to a pack with the last one.
template <typename T, int kBytes>
struct PaddedRest {
    static constexpr std::size_t kLanes = Pack<T, kBytes>::kLanes;

    T image[9][kLanes];
    T box[6][kLanes];
    BatchInput<T> input;

    PaddedRest(const BatchInput<T>& whole, std::size_t begin) noexcept : input(whole) {
        const auto pad = [&](const T* from, T* to) {
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                to[lane] = from[begin + lane < whole.count ? begin + lane : whole.count - 1];
            }
            return to;
        };
        input.count = kLanes;
        for (int column = 0; column < 6; ++column) {
            input.box[column] = pad(whole.box[column], box[column]);
        }
        for (int column = 0; column < 9 && !whole.one_image; ++column) {
            input.image[column] = pad(whole.image[column], image[column]);
        }
    }
};

/// Calls `store(evaluate(image terms, box terms), index)` for each full pack, and returns where the
/// rest begins.
template <typename T, int kBytes, typename Evaluate, typename Store>
[[nodiscard]] std::size_t
for_each_pack(const BatchInput<T>& input, const Evaluate& evaluate, const Store& store) noexcept {
    using Number = Pack<T, kBytes>;
    constexpr std::size_t kLanes = Number::kLanes;
    const std::size_t end = input.count - input.count % kLanes;
    const auto boxes = [&](const ImageTerms<Number>& image, std::size_t at) {
        const auto lo = load_triple<T, kBytes>(input.box, at);
        return box_terms(image, lo, load_triple<T, kBytes>(input.box + 3, at));
    };
    if (input.one_image && end > 0) {
        const ImageTerms<Number> image = load_image<T, kBytes>(input, 0);
        for (std::size_t at = 0; at < end; at += kLanes) {
            store(evaluate(image, boxes(image, at)), at);
        }
    } else {
        for (std::size_t at = 0; at < end; at += kLanes) {
            const ImageTerms<Number> image = load_image<T, kBytes>(input, at);
            store(evaluate(image, boxes(image, at)), at);
        }
    }
    return end;
}

/// Functions of one pack, as types, so that each loop is compiled around its own.
struct Corners {
    template <typename Number>
    Number operator()(const ImageTerms<Number>& image, const BoxTerms<Number>& box) const noexcept {
        return corner_angle(image, box);
    }
};
struct CheapBound {
    template <typename Number>
    Number operator()(const ImageTerms<Number>& image, const BoxTerms<Number>& box) const noexcept {
        return bound_t1(image, box);
    }
};
struct SmallerBound {
    template <typename Number>
    Number operator()(const ImageTerms<Number>& image, const BoxTerms<Number>& box) const noexcept {
        return least(bound_t1(image, box), bound_t2(image, box));
    }
};

/// Everything is inlined into the loop, so that terms stay in registers and those that one function
/// has no use for are never computed.
template <typename T, int kBytes, typename Evaluate>
[[gnu::flatten]] void angles_of(const BatchInput<T>& input, T* angles) noexcept {
    using Number = Pack<T, kBytes>;
    const std::size_t end =
        for_each_pack<T, kBytes>(input, Evaluate{}, [&](const Number& result, std::size_t at) {
            result.store(angles + at);
        });
    if (end < input.count) {
        const PaddedRest<T, kBytes> rest(input, end);
        T padded[Number::kLanes];
        angles_of<T, kBytes, Evaluate>(rest.input, padded);
        for (std::size_t i = end; i < input.count; ++i) {
            angles[i] = padded[i - end];
        }
    }
}

template <typename T, int kBytes>
[[gnu::flatten]] void
within_of(const BatchInput<T>& input, T threshold, std::uint8_t* within) noexcept {
    using Number = Pack<T, kBytes>;
    using Mask = typename Lanes<Number>::Mask;
    const Number limit(threshold);
    const std::size_t end = for_each_pack<T, kBytes>(
        input,
        [&](const ImageTerms<Number>& image, const BoxTerms<Number>& box) -> Mask {
            const Mask cheaply = bound_t1(image, box) <= limit;
            return Lanes<Number>::all(cheaply) ? cheaply
                                               : cheaply | (bound_t2(image, box) <= limit);
        },
        [&](const Mask& result, std::size_t at) {
            for (int lane = 0; lane < Number::kLanes; ++lane) {
                within[at + static_cast<std::size_t>(lane)] =
                    static_cast<std::uint8_t>(result.values[lane] & 1);
            }
        }
    );
    if (end < input.count) {
        const PaddedRest<T, kBytes> rest(input, end);
        std::uint8_t padded[Number::kLanes];
        within_of<T, kBytes>(rest.input, threshold, padded);
        for (std::size_t i = end; i < input.count; ++i) {
            within[i] = padded[i - end];
        }
    }
}

template <typename T, int kBytes>
inline constexpr BatchKernels<T> kBatchKernels{
    angles_of<T, kBytes, Corners>,
    angles_of<T, kBytes, CheapBound>,
    angles_of<T, kBytes, SmallerBound>,
    within_of<T, kBytes>};

} // namespace farfield::metric::detail

#endif
