#pragma once

namespace farfield::support {

/// Says why a test cannot run here; the program then counts as skipped. The caller returns.
void skip(const char* reason);

} // namespace farfield::support
