#pragma once

#include <cstdint>
#include <string>

namespace farfield {

/// The class of a failure. Programs branch on it; people read `Error::message`.
enum class ErrorCode : std::uint8_t {
    invalid_argument, ///< a parameter is outside its documented range
    bad_data,         ///< a file or an array holds something that cannot be drawn
    not_found,        ///< a file, or a part of one, does not exist
    unsupported,      ///< valid, but beyond what this build or device can do
    out_of_memory,    ///< an allocation or a budget is exhausted
    device,           ///< the graphics device or the operating system failed
};

/// Why a function could not do its work. The message names what, where and which value, for
/// instance "hills.obj:17: vertex coordinate y is nan".
struct Error {
    ErrorCode code = ErrorCode::invalid_argument;
    std::string message;
};

} // namespace farfield
