#include "embree/quad_depths.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#if defined(__GNUC__) && defined(__x86_64__)
#define FARFIELD_EMBREE_AVX2
#include <immintrin.h>
#endif

namespace farfield::embree {

namespace {

/// The depth that a page keeps of a place: of the texel of most weight that keeps one. [0, 1]
float kept_depth(const TileQuad& quad, const TexelPlace& place) noexcept {
    const std::uint16_t* lower = quad.kept + std::ptrdiff_t{place.y} * quad.page_size + place.x;
    const std::uint16_t* upper = lower + quad.page_size;
    const std::array<std::uint16_t, 4> depths = {lower[0], lower[1], upper[0], upper[1]};
    // Weights have 8 bits, as those of colours.
    constexpr std::uint32_t kWhole = 0x100;
    const std::uint32_t right = place.share_x >> 8U;
    const std::uint32_t up = place.share_y >> 8U;
    const std::array<std::uint32_t, 4> weights = {
        (kWhole - right) * (kWhole - up), right * (kWhole - up), (kWhole - right) * up, right * up};
    std::uint32_t most = 0;
    std::uint32_t found = kNoKeptDepth;
    for (std::size_t i = 0; i < depths.size(); ++i) {
        if (depths[i] != kNoKeptDepth && weights[i] > most) {
            most = weights[i];
            found = depths[i];
        }
    }
    return static_cast<float>(found) / static_cast<float>(kNoKeptDepth);
}

void find_portable(const TileQuad& quad, TileBuffer& tile) noexcept {
    const float span = quad.far_ratio - quad.near_ratio;
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        const auto y = static_cast<float>(row);
        for (std::int32_t column = quad.left; column < quad.right; ++column) {
            const auto x = static_cast<float>(column);
            const float w = (quad.w + quad.w_y * y) + quad.w_x * x;
            float& depth = tile.quad_depths[tile_pixel(column, row)];
            if (!(w > 0.0F)) {
                depth = quad.farthest; // behind the eye: not seen, wherever it stands
                continue;
            }
            depth = 1.0F / w;
            if (quad.stands == QuadDepth::texel) {
                // Beyond an end of the quad there is what is at the end.
                const float u = ((quad.u + quad.u_y * y) + quad.u_x * x) / w;
                const float v = ((quad.v + quad.v_y * y) + quad.v_x * x) / w;
                const TexelPlace place = texel_place(
                    quad, std::clamp(u, 0.0F, quad.width), std::clamp(v, 0.0F, quad.height)
                );
                const float ratio = quad.near_ratio + kept_depth(quad, place) * span;
                depth = quad.viewpoint_depth + (depth - quad.viewpoint_depth) * ratio;
            }
            depth = std::clamp(depth, quad.nearest, quad.farthest);
        }
    }
}

void write_portable(const TileQuad& quad, TileBuffer& tile) noexcept {
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
            if (inside && quad.depths[pixel] <= tile.depths[pixel] &&
                filtered(quad, texel_place(quad, u, v))[3] >= kHalfAlpha) {
                tile.depths[pixel] = quad.depths[pixel];
            }
        }
    }
}

} // namespace

QuadDepthWork portable_depth_work() noexcept {
    return {find_portable, write_portable};
}

#ifdef FARFIELD_EMBREE_AVX2

namespace {

#define FARFIELD_AVX2 __attribute__((target("avx2")))

constexpr std::int32_t kWide = 8;

/// Coordinates of a quad at eight pixels of a row.
struct EightPoints {
    __m256 u;
    __m256 v;
    __m256 w;
};

FARFIELD_AVX2 inline EightPoints
points_at(const TileQuad& quad, std::int32_t column, std::int32_t row) noexcept {
    const auto y = static_cast<float>(row);
    const __m256 x = _mm256_add_ps(
        _mm256_set1_ps(static_cast<float>(column)), _mm256_set_ps(7, 6, 5, 4, 3, 2, 1, 0)
    );
    const __m256 u = _mm256_add_ps(
        _mm256_set1_ps(quad.u + quad.u_y * y), _mm256_mul_ps(_mm256_set1_ps(quad.u_x), x)
    );
    const __m256 v = _mm256_add_ps(
        _mm256_set1_ps(quad.v + quad.v_y * y), _mm256_mul_ps(_mm256_set1_ps(quad.v_x), x)
    );
    const __m256 w = _mm256_add_ps(
        _mm256_set1_ps(quad.w + quad.w_y * y), _mm256_mul_ps(_mm256_set1_ps(quad.w_x), x)
    );
    return {_mm256_div_ps(u, w), _mm256_div_ps(v, w), w};
}

/// Places of filtered texels, as `texel_place`: the lower left of the four and the weights of the
/// others, of 256.
struct EightPlaces {
    __m256i offset; ///< into the page [texel]
    __m256i right;
    __m256i up;
};

FARFIELD_AVX2 inline __m256i
place_along(__m256 at, std::int32_t first, std::int32_t page_size) noexcept {
    const __m256i rounded = _mm256_cvttps_epi32(
        _mm256_add_ps(_mm256_mul_ps(at, _mm256_set1_ps(256.0F)), _mm256_set1_ps(0.5F))
    );
    const __m256i moved = _mm256_add_epi32(rounded, _mm256_set1_epi32(first * 256 - 128));
    const __m256i last = _mm256_set1_epi32((page_size - 1) * 256);
    return _mm256_min_epi32(_mm256_max_epi32(moved, _mm256_setzero_si256()), last);
}

FARFIELD_AVX2 inline EightPlaces places_at(const TileQuad& quad, __m256 u, __m256 v) noexcept {
    const __m256i x = place_along(u, quad.first_u, quad.page_size);
    const __m256i y = place_along(v, quad.first_v, quad.page_size);
    const __m256i fraction = _mm256_set1_epi32(0xFF);
    return {
        _mm256_add_epi32(
            _mm256_mullo_epi32(_mm256_srli_epi32(y, 8), _mm256_set1_epi32(quad.page_size)),
            _mm256_srli_epi32(x, 8)
        ),
        _mm256_and_si256(x, fraction),
        _mm256_and_si256(y, fraction)};
}

/// The depths kept of eight places. [0, 1]
FARFIELD_AVX2 inline __m256 kept_depths(const TileQuad& quad, const EightPlaces& places) noexcept {
    // Two neighbouring depths at once.
    constexpr int kBytes = 2;
    const auto load = [&](const std::uint16_t* from) FARFIELD_AVX2 {
        return _mm256_i32gather_epi32(reinterpret_cast<const int*>(from), places.offset, kBytes);
    };
    const __m256i lower = load(quad.kept);
    const __m256i upper = load(quad.kept + quad.page_size);
    const __m256i nothing = _mm256_set1_epi32(kNoKeptDepth);
    const __m256i whole = _mm256_set1_epi32(0x100);
    const __m256i left = _mm256_sub_epi32(whole, places.right);
    const __m256i down = _mm256_sub_epi32(whole, places.up);
    __m256i most = _mm256_setzero_si256();
    __m256i found = nothing;
    const auto consider = [&](__m256i depth, __m256i across, __m256i along) FARFIELD_AVX2 {
        const __m256i weight = _mm256_mullo_epi32(across, along);
        const __m256i better = _mm256_andnot_si256(
            _mm256_cmpeq_epi32(depth, nothing), _mm256_cmpgt_epi32(weight, most)
        );
        most = _mm256_blendv_epi8(most, weight, better);
        found = _mm256_blendv_epi8(found, depth, better);
    };
    const auto first = [&](__m256i pair) FARFIELD_AVX2 { return _mm256_and_si256(pair, nothing); };
    const auto second = [&](__m256i pair) FARFIELD_AVX2 { return _mm256_srli_epi32(pair, 16); };
    consider(first(lower), left, down);
    consider(second(lower), places.right, down);
    consider(first(upper), left, places.up);
    consider(second(upper), places.right, places.up);
    return _mm256_div_ps(
        _mm256_cvtepi32_ps(found), _mm256_set1_ps(static_cast<float>(kNoKeptDepth))
    );
}

FARFIELD_AVX2 void find_avx2(const TileQuad& quad, TileBuffer& tile) noexcept {
    const __m256 one = _mm256_set1_ps(1.0F);
    const __m256 zero = _mm256_setzero_ps();
    const __m256 nearest = _mm256_set1_ps(quad.nearest);
    const __m256 farthest = _mm256_set1_ps(quad.farthest);
    const __m256 viewpoint = _mm256_set1_ps(quad.viewpoint_depth);
    const __m256 near_ratio = _mm256_set1_ps(quad.near_ratio);
    const __m256 span = _mm256_set1_ps(quad.far_ratio - quad.near_ratio);
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        for (std::int32_t column = quad.left / kWide * kWide; column < quad.right;
             column += kWide) {
            const EightPoints points = points_at(quad, column, row);
            __m256 depth = _mm256_div_ps(one, points.w);
            if (quad.stands == QuadDepth::texel) {
                // Of what is no number, the greater one is zero.
                const __m256 u =
                    _mm256_min_ps(_mm256_max_ps(points.u, zero), _mm256_set1_ps(quad.width));
                const __m256 v =
                    _mm256_min_ps(_mm256_max_ps(points.v, zero), _mm256_set1_ps(quad.height));
                const __m256 kept = kept_depths(quad, places_at(quad, u, v));
                const __m256 ratio = _mm256_add_ps(near_ratio, _mm256_mul_ps(kept, span));
                depth =
                    _mm256_add_ps(viewpoint, _mm256_mul_ps(_mm256_sub_ps(depth, viewpoint), ratio));
            }
            depth = _mm256_min_ps(_mm256_max_ps(depth, nearest), farthest);
            const __m256 before_eye = _mm256_cmp_ps(points.w, zero, _CMP_GT_OQ);
            _mm256_store_ps(
                &tile.quad_depths[tile_pixel(column, row)],
                _mm256_blendv_ps(farthest, depth, before_eye)
            );
        }
    }
}

/// a (1 - share) + b share, in 16 bits; share of 256.
FARFIELD_AVX2 inline __m256i mixed(__m256i a, __m256i b, __m256i share) noexcept {
    const auto part = [&](__m256i of) FARFIELD_AVX2 {
        return _mm256_srli_epi32(_mm256_mullo_epi32(of, share), 8);
    };
    return _mm256_add_epi32(_mm256_sub_epi32(a, part(a)), part(b));
}

/// Filtered alpha of eight places.
FARFIELD_AVX2 inline __m256i alphas(const TileQuad& quad, const EightPlaces& places) noexcept {
    constexpr int kBytes = 4;
    const auto load = [&](const std::uint32_t* from) FARFIELD_AVX2 {
        const __m256i texels =
            _mm256_i32gather_epi32(reinterpret_cast<const int*>(from), places.offset, kBytes);
        return _mm256_slli_epi32(_mm256_srli_epi32(texels, 24), 8);
    };
    const std::uint32_t* upper = quad.texels + quad.page_size;
    const __m256i left = mixed(load(quad.texels), load(upper), places.up);
    const __m256i right = mixed(load(quad.texels + 1), load(upper + 1), places.up);
    return mixed(left, right, places.right);
}

FARFIELD_AVX2 void write_avx2(const TileQuad& quad, TileBuffer& tile) noexcept {
    const __m256 low_u = _mm256_set1_ps(quad.rim_u);
    const __m256 low_v = _mm256_set1_ps(quad.rim_v);
    const __m256 high_u = _mm256_set1_ps(quad.width - quad.rim_u);
    const __m256 high_v = _mm256_set1_ps(quad.height - quad.rim_v);
    const __m256i below_half = _mm256_set1_epi32(kHalfAlpha - 1);
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        for (std::int32_t column = quad.left / kWide * kWide; column < quad.right;
             column += kWide) {
            const std::size_t pixel = tile_pixel(column, row);
            const EightPoints points = points_at(quad, column, row);
            const __m256 in_u = _mm256_and_ps(
                _mm256_cmp_ps(points.u, low_u, _CMP_GE_OQ),
                _mm256_cmp_ps(points.u, high_u, _CMP_LT_OQ)
            );
            const __m256 in_v = _mm256_and_ps(
                _mm256_cmp_ps(points.v, low_v, _CMP_GE_OQ),
                _mm256_cmp_ps(points.v, high_v, _CMP_LT_OQ)
            );
            const __m256 before_eye = _mm256_cmp_ps(points.w, _mm256_setzero_ps(), _CMP_GT_OQ);
            const __m256 depth = _mm256_load_ps(&quad.depths[pixel]);
            const __m256 there = _mm256_load_ps(&tile.depths[pixel]);
            const __m256 seen = _mm256_and_ps(
                _mm256_and_ps(in_u, in_v),
                _mm256_and_ps(before_eye, _mm256_cmp_ps(depth, there, _CMP_LE_OQ))
            );
            if (_mm256_movemask_ps(seen) == 0) {
                continue;
            }
            // Places of pixels outside may be anything; clamping keeps them in the page.
            const __m256i alpha = alphas(quad, places_at(quad, points.u, points.v));
            const __m256 owned =
                _mm256_and_ps(seen, _mm256_castsi256_ps(_mm256_cmpgt_epi32(alpha, below_half)));
            _mm256_store_ps(&tile.depths[pixel], _mm256_blendv_ps(there, depth, owned));
        }
    }
}

#undef FARFIELD_AVX2

} // namespace

QuadDepthWork fastest_depth_work() noexcept {
    static const bool kAvx2 = __builtin_cpu_supports("avx2") != 0;
    return kAvx2 ? QuadDepthWork{find_avx2, write_avx2} : portable_depth_work();
}

#else

QuadDepthWork fastest_depth_work() noexcept {
    return portable_depth_work();
}

#endif

} // namespace farfield::embree
