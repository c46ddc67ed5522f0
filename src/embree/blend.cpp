#include "embree/blend.hpp"

#include <algorithm>
#include <cstddef>

#if defined(__GNUC__) && defined(__x86_64__)
#define FARFIELD_EMBREE_AVX2
#include <immintrin.h>
#endif

namespace farfield::embree {

namespace {

constexpr float kSteps = 256.0F; // of a texel, to which places are rounded
constexpr float kHalf = 0.5F;

/// a (1 - share) + b share, in 16 bits; share of 65536.
std::uint32_t mixed(std::uint32_t a, std::uint32_t b, std::uint32_t share) noexcept {
    return a - (a * share >> 16U) + (b * share >> 16U);
}

std::uint32_t channel(std::uint32_t rgba, std::size_t index) noexcept {
    return (rgba >> (8 * index) & 0xFFU) << 8U;
}

} // namespace

TexelPlace texel_place(const TileQuad& quad, float u, float v) noexcept {
    // Never negative, so that cutting off after adding a half rounds; and only 0 to the last texel
    // is left of it, which the largest weight does not reach beyond.
    const std::int32_t last = (quad.page_size - 1) * 256;
    const auto along = [&](float at, std::int32_t first) {
        const float rounded = at * kSteps + kHalf;
        return std::clamp(static_cast<std::int32_t>(rounded) + first * 256 - 128, 0, last);
    };
    const std::int32_t x = along(u, quad.first_u);
    const std::int32_t y = along(v, quad.first_v);
    return {
        x >> 8,
        y >> 8,
        static_cast<std::uint32_t>(x & 0xFF) << 8U,
        static_cast<std::uint32_t>(y & 0xFF) << 8U};
}

Color16 filtered(const TileQuad& quad, const TexelPlace& place) noexcept {
    const std::uint32_t* lower = quad.texels + std::ptrdiff_t{place.y} * quad.page_size + place.x;
    const std::uint32_t* upper = lower + quad.page_size;
    Color16 color{};
    for (std::size_t i = 0; i < color.size(); ++i) {
        const std::uint32_t left = mixed(channel(lower[0], i), channel(upper[0], i), place.share_y);
        const std::uint32_t right =
            mixed(channel(lower[1], i), channel(upper[1], i), place.share_y);
        color[i] = static_cast<std::uint16_t>(mixed(left, right, place.share_x));
    }
    return color;
}

void blend(const Color16& source, Color16& target) noexcept {
    // An alpha of 0xFF00 is 1, and takes all of what was there.
    const std::uint32_t share = source[3] + (source[3] >> 8U);
    for (std::size_t i = 0; i < target.size(); ++i) {
        const std::uint32_t behind = target[i] - (target[i] * share >> 16U);
        target[i] = static_cast<std::uint16_t>(std::min(source[i] + behind, 0xFFFFU));
    }
}

void blend_quad_portable(const TileQuad& quad, TileBuffer& tile) noexcept {
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        const auto y = static_cast<float>(row);
        for (std::int32_t column = quad.left; column < quad.right; ++column) {
            const auto x = static_cast<float>(column);
            const float w = (quad.w + quad.w_y * y) + quad.w_x * x;
            const float u = ((quad.u + quad.u_y * y) + quad.u_x * x) / w;
            const float v = ((quad.v + quad.v_y * y) + quad.v_x * x) / w;
            const std::size_t pixel = tile_pixel(column, row);
            const bool inside = w > 0.0F && u >= quad.rim_u && u < quad.width - quad.rim_u &&
                                v >= quad.rim_v && v < quad.height - quad.rim_v;
            if (inside && depth_at(quad, pixel) <= tile.depths[pixel] &&
                quad.order > tile.orders[pixel]) {
                blend(filtered(quad, texel_place(quad, u, v)), tile.colors[pixel]);
            }
        }
    }
}

#ifdef FARFIELD_EMBREE_AVX2

namespace {

#define FARFIELD_AVX2 __attribute__((target("avx2")))

/// Four places, each as eight numbers of 16 bits in its half of a register: which two of eight.
FARFIELD_AVX2 inline __m256i spread(__m128i shares, int first, int second) noexcept {
    const auto bytes = [](int index) {
        return static_cast<short>(index * 2 | (index * 2 + 1) << 8);
    };
    const __m256i pattern =
        _mm256_set_m128i(_mm_set1_epi16(bytes(second)), _mm_set1_epi16(bytes(first)));
    return _mm256_shuffle_epi8(_mm256_broadcastsi128_si256(shares), pattern);
}

FARFIELD_AVX2 inline __m256i mixed(__m256i a, __m256i b, __m256i share) noexcept {
    return _mm256_add_epi16(
        _mm256_sub_epi16(a, _mm256_mulhi_epu16(a, share)), _mm256_mulhi_epu16(b, share)
    );
}

/// Two neighbouring texels each of two places, 16 bits a channel.
FARFIELD_AVX2 inline __m256i
load_pairs(const std::uint32_t* first, const std::uint32_t* second) noexcept {
    const __m128i both = _mm_unpacklo_epi64(
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(first)),
        _mm_loadl_epi64(reinterpret_cast<const __m128i*>(second))
    );
    return _mm256_slli_epi16(_mm256_cvtepu8_epi16(both), 8);
}

/// Filters four pixels: in order, four channels of 16 bits each.
FARFIELD_AVX2 inline __m256i filter_four(
    const std::uint32_t* texels,
    const std::int32_t* offsets,
    std::ptrdiff_t row,
    __m128i shares_x,
    __m128i shares_y,
    int first
) noexcept {
    const std::uint32_t* const t0 = texels + offsets[first];
    const std::uint32_t* const t1 = texels + offsets[first + 1];
    const std::uint32_t* const t2 = texels + offsets[first + 2];
    const std::uint32_t* const t3 = texels + offsets[first + 3];
    const __m256i v01 = mixed(
        load_pairs(t0, t1), load_pairs(t0 + row, t1 + row), spread(shares_y, first, first + 1)
    );
    const __m256i v23 = mixed(
        load_pairs(t2, t3), load_pairs(t2 + row, t3 + row), spread(shares_y, first + 2, first + 3)
    );
    // Left and right texels of the pixels 0, 2, 1, 3.
    const __m256i left = _mm256_unpacklo_epi64(v01, v23);
    const __m256i right = _mm256_unpackhi_epi64(v01, v23);
    const __m256i x01 = spread(shares_x, first, first + 1);
    const __m256i x23 = spread(shares_x, first + 2, first + 3);
    const __m256i result = mixed(left, right, _mm256_unpacklo_epi64(x01, x23));
    constexpr int kInOrder = 0 | 2 << 2 | 1 << 4 | 3 << 6;
    return _mm256_permute4x64_epi64(result, kInOrder);
}

/// Blends four pixels where a mask of 64 bits each says so.
FARFIELD_AVX2 inline void blend_four(__m256i source, __m256i mask, Color16* target) noexcept {
    source = _mm256_and_si256(source, mask);
    if (_mm256_testz_si256(source, source) != 0) {
        return;
    }
    auto* place = reinterpret_cast<__m256i*>(target);
    const __m256i before = _mm256_load_si256(place);
    const __m256i alpha_of_all = _mm256_set1_epi64x(0x0706070607060706);
    const __m256i high = _mm256_set_epi64x(0x0808080808080808, 0, 0x0808080808080808, 0);
    const __m256i alpha = _mm256_shuffle_epi8(source, _mm256_add_epi8(alpha_of_all, high));
    const __m256i share = _mm256_add_epi16(alpha, _mm256_srli_epi16(alpha, 8));
    const __m256i behind = _mm256_sub_epi16(before, _mm256_mulhi_epu16(before, share));
    _mm256_store_si256(place, _mm256_adds_epu16(source, behind));
}

FARFIELD_AVX2 void blend_quad_avx2(const TileQuad& quad, TileBuffer& tile) noexcept {
    const __m256 steps = _mm256_set1_ps(kSteps);
    const __m256 half = _mm256_set1_ps(kHalf);
    const __m256 low_u = _mm256_set1_ps(quad.rim_u);
    const __m256 low_v = _mm256_set1_ps(quad.rim_v);
    const __m256 high_u = _mm256_set1_ps(quad.width - quad.rim_u);
    const __m256 high_v = _mm256_set1_ps(quad.height - quad.rim_v);
    const __m256 whole_depth = _mm256_set1_ps(quad.depth);
    const __m256i order = _mm256_set1_epi32(static_cast<int>(quad.order));
    const __m256i first_u = _mm256_set1_epi32(quad.first_u * 256 - 128);
    const __m256i first_v = _mm256_set1_epi32(quad.first_v * 256 - 128);
    const __m256i last = _mm256_set1_epi32((quad.page_size - 1) * 256);
    const __m256i size = _mm256_set1_epi32(quad.page_size);
    const __m256i zero = _mm256_setzero_si256();
    const __m256 lanes = _mm256_set_ps(7, 6, 5, 4, 3, 2, 1, 0);
    const __m256i fraction = _mm256_set1_epi32(0xFF);
    constexpr std::int32_t kWide = 8;
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        const auto y = static_cast<float>(row);
        const __m256 u_row = _mm256_set1_ps(quad.u + quad.u_y * y);
        const __m256 v_row = _mm256_set1_ps(quad.v + quad.v_y * y);
        const __m256 w_row = _mm256_set1_ps(quad.w + quad.w_y * y);
        for (std::int32_t column = quad.left / kWide * kWide; column < quad.right;
             column += kWide) {
            const std::size_t pixel = tile_pixel(column, row);
            const __m256 x = _mm256_add_ps(_mm256_set1_ps(static_cast<float>(column)), lanes);
            const __m256 w = _mm256_add_ps(w_row, _mm256_mul_ps(_mm256_set1_ps(quad.w_x), x));
            const __m256 u =
                _mm256_div_ps(_mm256_add_ps(u_row, _mm256_mul_ps(_mm256_set1_ps(quad.u_x), x)), w);
            const __m256 v =
                _mm256_div_ps(_mm256_add_ps(v_row, _mm256_mul_ps(_mm256_set1_ps(quad.v_x), x)), w);
            const __m256 in_u = _mm256_and_ps(
                _mm256_cmp_ps(u, low_u, _CMP_GE_OQ), _mm256_cmp_ps(u, high_u, _CMP_LT_OQ)
            );
            const __m256 in_v = _mm256_and_ps(
                _mm256_cmp_ps(v, low_v, _CMP_GE_OQ), _mm256_cmp_ps(v, high_v, _CMP_LT_OQ)
            );
            const __m256 before_eye = _mm256_cmp_ps(w, _mm256_setzero_ps(), _CMP_GT_OQ);
            const __m256 depth =
                quad.depths == nullptr ? whole_depth : _mm256_load_ps(&quad.depths[pixel]);
            const __m256 shown =
                _mm256_cmp_ps(depth, _mm256_load_ps(&tile.depths[pixel]), _CMP_LE_OQ);
            // Orders are counts of commands, far below 2^31.
            const __m256i later = _mm256_cmpgt_epi32(
                order, _mm256_load_si256(reinterpret_cast<const __m256i*>(&tile.orders[pixel]))
            );
            const __m256i mask = _mm256_and_si256(
                _mm256_castps_si256(
                    _mm256_and_ps(_mm256_and_ps(in_u, in_v), _mm256_and_ps(before_eye, shown))
                ),
                later
            );
            if (_mm256_testz_si256(mask, mask) != 0) {
                continue;
            }
            // Places of pixels outside may be anything; clamping keeps them in the page.
            const auto place = [&](__m256 at, __m256i first) FARFIELD_AVX2 {
                const __m256i rounded =
                    _mm256_cvttps_epi32(_mm256_add_ps(_mm256_mul_ps(at, steps), half));
                return _mm256_min_epi32(
                    _mm256_max_epi32(_mm256_add_epi32(rounded, first), zero), last
                );
            };
            const __m256i place_x = place(u, first_u);
            const __m256i place_y = place(v, first_v);
            alignas(32) std::int32_t offsets[kWide];
            _mm256_store_si256(
                reinterpret_cast<__m256i*>(offsets),
                _mm256_add_epi32(
                    _mm256_mullo_epi32(_mm256_srli_epi32(place_y, 8), size),
                    _mm256_srli_epi32(place_x, 8)
                )
            );
            const auto shares = [&](__m256i at) FARFIELD_AVX2 {
                const __m256i high = _mm256_slli_epi32(_mm256_and_si256(at, fraction), 8);
                return _mm_packus_epi32(
                    _mm256_castsi256_si128(high), _mm256_extracti128_si256(high, 1)
                );
            };
            const __m128i shares_x = shares(place_x);
            const __m128i shares_y = shares(place_y);
            blend_four(
                filter_four(quad.texels, offsets, quad.page_size, shares_x, shares_y, 0),
                _mm256_cvtepi32_epi64(_mm256_castsi256_si128(mask)),
                &tile.colors[pixel]
            );
            blend_four(
                filter_four(quad.texels, offsets, quad.page_size, shares_x, shares_y, 4),
                _mm256_cvtepi32_epi64(_mm256_extracti128_si256(mask, 1)),
                &tile.colors[pixel + 4]
            );
        }
    }
}

#undef FARFIELD_AVX2

} // namespace

BlendQuad fastest_blend_quad() noexcept {
    static const BlendQuad kFastest =
        __builtin_cpu_supports("avx2") != 0 ? blend_quad_avx2 : blend_quad_portable;
    return kFastest;
}

#else

BlendQuad fastest_blend_quad() noexcept {
    return blend_quad_portable;
}

#endif

} // namespace farfield::embree
