#pragma once

#include <farfield/core/result.hpp>
#include <farfield/io/atoms.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>
#include <vector>

namespace farfield::scenes {

/// A molecule like a protein. The default is the canonical scene: 6534 atoms of 800 triangles each,
/// 5.2 million.
/// @par Source Chamberlain et al. 1996, section 4: the numbers of atoms and of triangles; the
/// molecule is ours
struct MoleculeOptions {
    int atoms = 6534;         ///< exactly so many; [1, 1000000]
    std::uint64_t seed = 136; ///< of the fold and the side chains
};

/// Folds a chain of residues into a globule: helices side by side in a ball, loops between them,
/// and side chains in what room there is. The trace of the chain's alpha carbons, 3.8 angstrom
/// apart, is one continuous curve; peptide groups between them are flat and have the bonds and
/// angles of proteins, oxygens pointing along the helix. Side chains grow atom by atom away from
/// the chain and end where every turn of the next bond would come nearer than 3 angstrom to another
/// residue. Hydrogens are those of the backbone's nitrogens. The globule is turned at random, its
/// middle near 0.
/// @return atoms in the order of the chain, in angstrom; an error naming the option and its value
[[nodiscard]] Result<std::vector<io::Atom>> fold_molecule(const MoleculeOptions& options = {});

/// `fold_molecule` as balls, see `io::make_balls`.
[[nodiscard]] Result<Scene> make_molecule(const MoleculeOptions& options = {});

} // namespace farfield::scenes
