#pragma once

#include <farfield/core/error.hpp>

#include <tl/expected.hpp>

#include <string>
#include <utility>

namespace farfield {

/// A value, or the `Error` that says why there is none. Functions that return one are
/// `[[nodiscard]]`; the library itself throws nothing.
template <typename T>
using Result = tl::expected<T, Error>;

/// Shorthand for returning a failure from a function whose type is `Result<T>`.
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
    return tl::unexpected<Error>(Error{code, std::move(message)});
}

} // namespace farfield
