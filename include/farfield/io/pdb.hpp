#pragma once

#include <farfield/core/result.hpp>
#include <farfield/io/atoms.hpp>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace farfield::io {

/// Reads the atoms of a Protein Data Bank file: its ATOM and HETATM records.
///
/// Of several models the first is read. Where a residue has alternate locations, the one that is
/// named first is taken, and what the residue has but once. Elements are those of columns 77-78;
/// where these are blank, of the atom's name, whose first two columns hold the symbol, aligned to
/// the right; names of four characters that begin with H are hydrogen. All other records are left
/// out, and so is what follows the end of the model.
///
/// `load_scene` reads such files too, as balls: see `make_balls`.
///
/// @return at least one atom; `not_found` for a missing file, `out_of_memory` for one of more than
/// `max_file_bytes`, `unsupported` for more than `kMaxAtoms` atoms; `bad_data` with file, line,
/// columns and value for a coordinate that is missing, not a number, not finite or of a magnitude
/// that the format cannot write (1e5 and more), for an unknown element, and for a file without
/// atoms
/// @par Source Protein Data Bank Contents Guide, version 3.3, 2012
[[nodiscard]] Result<std::vector<Atom>>
read_pdb(const std::filesystem::path& path, std::uint64_t max_file_bytes = 1ULL << 30U);

} // namespace farfield::io
