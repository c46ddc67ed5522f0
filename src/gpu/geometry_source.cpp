#include <farfield/gpu/geometry_source.hpp>

namespace farfield {

Result<void> GeometrySource::prepare_projection(
    std::size_t /*keyframes*/, bool /*whole_triangles*/, bool /*positions*/
) noexcept {
    return {};
}

} // namespace farfield
