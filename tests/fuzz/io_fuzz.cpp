// Damaged files: small valid ones of every format, changed at random with a fixed seed. Each must
// be refused with a message or give a scene that passes `validate`; a crash or an exception ends
// the program. Run under the sanitizers this finds what reads or writes astray.
#include "io/files.hpp"
#include <farfield/io/mesh_tools.hpp>
#include <farfield/io/png.hpp>

#include <catch2/catch.hpp>
#include <png.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

using namespace farfield;

namespace {

constexpr int kRunsPerSeed = 2000;

struct Seed {
    std::string name; ///< with the extension that chooses the reader
    std::string bytes;
};

std::string height_png() {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = 3;
    image.height = 3;
    image.format = PNG_FORMAT_LINEAR_Y;
    const std::vector<std::uint16_t> samples = {1, 2, 3, 4, 5, 6, 7, 8, 9};
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string bytes(size, '\0');
    REQUIRE(
        png_image_write_to_memory(&image, bytes.data(), &size, 0, samples.data(), 0, nullptr) != 0
    );
    bytes.resize(size);
    return bytes;
}

std::string binary_ply() {
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex 4\n"
                        "property float x\nproperty float y\nproperty float z\n"
                        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                        "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    for (int i = 0; i < 4; ++i) {
        support::append(bytes, static_cast<float>(i % 2));
        support::append(bytes, i < 2 ? 0.0F : 1.0F);
        support::append(bytes, 0.5F);
        bytes += "abc";
    }
    for (const int first : {0, 1}) {
        bytes += '\x03';
        for (int k = 0; k < 3; ++k) {
            support::append(bytes, first + k);
        }
    }
    return bytes;
}

std::string binary_stl() {
    std::string bytes(80, ' ');
    support::append(bytes, std::uint32_t{2});
    for (int facet = 0; facet < 2; ++facet) {
        for (int i = 0; i < 12; ++i) {
            support::append(bytes, static_cast<float>(i * (facet + 1) % 5));
        }
        bytes.append(2, '\0');
    }
    return bytes;
}

/// Two models, alternate locations, elements by column and by name.
std::string pdb() {
    return "HEADER    TEST\nMODEL        1\n"
           "ATOM      1  N   GLY A   1      11.104   6.134  -6.504  1.00  0.00           N  \n"
           "ATOM      2  CA AGLY A   1      11.639   6.071  -5.147  0.50  0.00           C  \n"
           "ATOM      3  CA BGLY A   1      11.700   6.000  -5.200  0.50  0.00           C  \n"
           "ATOM      4 HG11 VAL A   2       9.000   1.5e0  +2.000\n"
           "TER\nHETATM    5 ZN    ZN A 101       1.000   2.000   3.000  1.00  0.00          ZN2+\n"
           "ENDMDL\nMODEL        2\n"
           "ATOM      1  N   GLY A   1      11.104   6.134  -6.504\nENDMDL\nEND\n";
}

/// A glTF with something of everything.
std::string glb_json() {
    return support::triangle_json(
        R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0},
                           {"attributes":{"POSITION":0,"COLOR_0":0,"NORMAL":0},"mode":5}]}])",
        R"([{"mesh":0,"children":[1],"rotation":[0,0,0,1]},
            {"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,1,2,3,1]}])",
        R"(,"scene":0,"scenes":[{"nodes":[0]}],"images":[{"bufferView":0,"mimeType":"image/png"},
            {"uri":"data:image/png;base64,iVBORw0KGgo="},{"uri":"colour.png"}],
            "textures":[{"source":0},{"source":1},{"source":2}],
            "materials":[{"alphaMode":"BLEND","pbrMetallicRoughness":{
                "baseColorFactor":[1,0.5,0.25,1],"baseColorTexture":{"index":2}}},
                {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
            "samplers":[{}],"cameras":[{"type":"perspective","perspective":{"yfov":1,"znear":1}}],
            "animations":[{"channels":[],"samplers":[]}],"skins":[{"joints":[0]}],
            "extras":{"a":[1,2,{"b":null}]},"extensionsUsed":["KHR_lights_punctual"],
            "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}})"
    );
}

/// The same with its buffer in a file of its own.
std::string gltf_json() {
    const std::string buffer = R"({"byteLength":44)";
    std::string json = glb_json();
    return json.replace(json.find(buffer), buffer.size(), buffer + R"(,"uri":"data.bin")");
}

std::vector<Seed> make_seeds() {
    return {
        {"a.obj",
         "mtllib a.mtl\n# c\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1e-3\nvt 0 0\nvt 1 1\n"
         "vn 0 0 1\nusemtl red\nf 1/1/1 2/2/1 3//1\nusemtl a\nf -4 -3 \\\n-2 -1\nl 1 2\n"},
        {"a.off",
         "COFF\n# c\n4 2 0\n0 0 0 255 0 0\n1 0 0 0 255 0\n1 1 0 1 2 3\n0 1 0 4 5 6\n"
         "3 0 1 2\n4 0 1 2 3 0.5 0.5 0.5\n"},
        {"a.ply",
         "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\n"
         "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
         "property float s\nproperty float t\nelement face 2\n"
         "property list uchar int vertex_indices\nend_header\n0 0 0 0 0 1 0 0\n"
         "1 0 0 0 0 1 1 0\n1 1 0 0 0 1 1 1\n0 1 0 0 0 1 0 1\n3 0 1 2\n4 0 1 2 3\n"},
        {"b.ply", binary_ply()},
        {"a.stl",
         "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
         "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n"},
        {"b.stl", binary_stl()},
        {"a.gltf", gltf_json()},
        {"a.glb", support::make_glb(glb_json(), support::triangle_binary())},
        {"a.pdb", pdb()},
        {"a.png", height_png()},
    };
}

/// Words that mean something to one of the formats, and numbers at the edges of theirs.
const std::vector<std::string>& dictionary() {
    static const std::vector<std::string> words = {
        "nan",
        "     nan",
        "\nENDMDL\n",
        "inf",
        "-1",
        "0",
        "1e999",
        "-2147483648",
        "2147483647",
        "4294967295",
        "18446744073709551615",
        "1e-400",
        "\n",
        "\\\n",
        "/",
        "//",
        "#",
        "[",
        "]",
        "{",
        "}",
        "\"",
        ",",
        "null",
        "-0.0",
        "list",
        "uint",
        "element face 4000000000\n",
        "f 1 2 3 4 5\n",
        "vn 0\n",
        std::string(4, '\0'),
        std::string(4, '\xff'),
        std::string("\0\0\0\x80", 4),
        R"("byteOffset":99999999,)",
        R"("sparse":{"count":1},)",
        R"("children":[0],)",
        R"("byteStride":1,)",
        R"("bufferView":-1,)",
    };
    return words;
}

class Mutator {
  public:
    explicit Mutator(std::uint32_t seed) : random_(seed) {}

    std::string mutate(std::string bytes, const std::string& other) {
        for (std::size_t step = 1 + below(4); step-- > 0;) {
            const std::size_t at = below(bytes.size() + 1);
            const std::size_t length = std::min(1 + below(16), bytes.size() - at);
            switch (below(8)) {
            case 0: // flip a bit
                if (at < bytes.size()) {
                    bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
                }
                break;
            case 1: // any byte
                if (at < bytes.size()) {
                    bytes[at] = static_cast<char>(below(256));
                }
                break;
            case 2:
                bytes.erase(at, length);
                break;
            case 3: // repeat what is there
                bytes.insert(at, bytes.substr(at, length));
                break;
            case 4: // another number
                replace_digit(bytes, at);
                break;
            case 5:
                bytes.replace(at, length, dictionary()[below(dictionary().size())]);
                break;
            case 6: // splice
                bytes.replace(at, bytes.size() - at, other.substr(below(other.size() + 1)));
                break;
            default: // truncate, rarely
                if (below(4) == 0) {
                    bytes.resize(at);
                }
                break;
            }
        }
        return bytes;
    }

    std::size_t below(std::size_t limit) { return random_() % limit; }

  private:
    /// The first digit from `at` on.
    void replace_digit(std::string& bytes, std::size_t at) {
        const auto digit =
            std::find_if(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), [](char c) {
                return c >= '0' && c <= '9';
            });
        if (digit != bytes.end()) {
            *digit = static_cast<char>('0' + below(10));
        }
    }

    std::mt19937 random_;
};

} // namespace

TEST_CASE("damaged files are refused or give a valid scene") {
    const std::vector<Seed> seeds = make_seeds();
    support::TemporaryFolder folder;
    folder.write("data.bin", support::triangle_binary());
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\nmap_Kd colour.png\n");
    folder.write(
        "a.json", R"({"width":3,"height":3,"spacing_m":1,"height_scale":1,"height_offset":0})"
    );
    REQUIRE(io::write_png(folder.path() / "colour.png", {1, 1, {1, 2, 3, 4}}).has_value());
    Mutator mutator(2024);
    int loaded_count = 0;
    int refused_count = 0;
    for (const Seed& seed : seeds) {
        {
            const auto whole = io::load_scene(folder.write(seed.name, seed.bytes));
            INFO(seed.name << ": " << (whole ? "" : whole.error().message));
            REQUIRE(whole.has_value());
        }
        for (int run = 0; run < kRunsPerSeed; ++run) {
            const std::string& other = seeds[mutator.below(seeds.size())].bytes;
            const std::string bytes = mutator.mutate(seed.bytes, other);
            auto loaded =
                io::load_scene(folder.write(seed.name, bytes), {.flag_splittable = run % 2 == 0});
            if (!loaded) {
                ++refused_count;
                if (loaded.error().message.empty()) {
                    FAIL(seed.name << " run " << run << " was refused without a message");
                }
                continue;
            }
            ++loaded_count;
            for (Mesh& mesh : loaded->scene.meshes) {
                io::optimize_for_drawing(mesh);
            }
            if (const auto checked = validate(loaded->scene); !checked) {
                FAIL(seed.name << " run " << run << ": " << checked.error().message);
            }
        }
    }
    // Both ways must have been taken, or the damage is too small or too great to find anything.
    CHECK(loaded_count > 100);
    CHECK(refused_count > 100);
}

TEST_CASE("damaged layouts and pictures beside a height field never end the program") {
    support::TemporaryFolder folder;
    const auto path = folder.write("a.png", height_png());
    const std::string layout =
        R"({"width":3,"height":3,"spacing_m":1,"height_scale":1,"height_offset":0})";
    REQUIRE(io::write_png(folder.path() / "seed.png", {2, 2, std::vector<std::uint8_t>(16, 7)})
                .has_value());
    std::ifstream file(folder.path() / "seed.png", std::ios::binary);
    const std::string colour{std::istreambuf_iterator<char>(file), {}};
    Mutator mutator(2025);
    for (int run = 0; run < kRunsPerSeed; ++run) {
        folder.write("a.json", run % 2 == 0 ? layout : mutator.mutate(layout, layout));
        folder.write("a_colour.png", mutator.mutate(colour, layout));
        const auto loaded = io::load_scene(path);
        if (loaded) {
            REQUIRE(validate(loaded->scene).has_value());
        }
    }
}
