#pragma once

#include <cctype>
#include <cstddef>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// Reads markup as strictly as XML has it, as far as reports use it.
namespace farfield::test {

struct Element {
    std::string name;
    std::map<std::string, std::string> attributes; ///< as written, entities and all
    std::string text;    ///< between its tags, that of its children included
    std::string parents; ///< "/html/body"

    [[nodiscard]] std::string attribute(const std::string& key) const {
        const auto found = attributes.find(key);
        return found == attributes.end() ? std::string() : found->second;
    }

    [[nodiscard]] bool has_class(const std::string& wanted) const {
        return (" " + attribute("class") + " ").find(" " + wanted + " ") != std::string::npos;
    }
};

/// All elements in the order of their start tags. Throws std::runtime_error where tags do not nest,
/// an attribute has no quotes or comes twice, an ampersand begins no entity, or a byte is a control
/// character.
inline std::vector<Element> parse_markup(std::string_view text) {
    const auto fail_at = [&](std::size_t at, const std::string& what) {
        throw std::runtime_error(
            what + " at byte " + std::to_string(at) + ": " + std::string(text.substr(at, 60))
        );
    };
    const auto check_text = [&](std::size_t begin, std::size_t end) {
        for (std::size_t at = begin; at < end; ++at) {
            const auto byte = static_cast<unsigned char>(text[at]);
            if (byte < 0x20U && byte != '\n' && byte != '\t') {
                fail_at(at, "control character");
            }
            if (text[at] == '&') {
                const std::string_view rest = text.substr(at);
                bool known = false;
                for (const std::string_view entity : {"&amp;", "&lt;", "&gt;", "&quot;"}) {
                    known = known || rest.starts_with(entity);
                }
                if (!known) {
                    fail_at(at, "bare ampersand");
                }
            }
        }
    };
    std::vector<Element> elements;
    std::vector<std::size_t> open;
    std::size_t at = text.starts_with("<!DOCTYPE html>") ? text.find('>') + 1 : 0;
    while (at < text.size()) {
        if (text[at] != '<') {
            const std::size_t end = std::min(text.find('<', at), text.size());
            check_text(at, end);
            for (const std::size_t element : open) {
                elements[element].text += text.substr(at, end - at);
            }
            at = end;
            continue;
        }
        const std::size_t start = at++;
        const bool closes = text.substr(at).starts_with('/');
        at += closes ? 1 : 0;
        std::string name;
        while (at < text.size() && std::isalnum(static_cast<unsigned char>(text[at])) != 0) {
            name += text[at++];
        }
        if (name.empty()) {
            fail_at(start, "tag without a name");
        }
        if (closes) {
            if (open.empty() || elements[open.back()].name != name) {
                fail_at(start, "end tag without its start");
            }
            open.pop_back();
            at = text.find('>', at) + 1;
            continue;
        }
        Element element;
        element.name = name;
        for (const std::size_t parent : open) {
            element.parents += "/" + elements[parent].name;
        }
        bool ends = false;
        for (;;) {
            at = text.find_first_not_of(" \n", at);
            if (at == std::string_view::npos) {
                fail_at(start, "tag without an end");
            }
            if (text[at] == '>' || text.substr(at).starts_with("/>")) {
                ends = text[at] == '/';
                at += ends ? 2 : 1;
                break;
            }
            const std::size_t equals = text.find("=\"", at);
            const std::size_t end = text.find('"', equals + 2);
            if (equals == std::string_view::npos || end == std::string_view::npos) {
                fail_at(at, "attribute without a value");
            }
            const std::string key(text.substr(at, equals - at));
            if (key.find_first_of("<> \"") != std::string::npos) {
                fail_at(at, "attribute without a value");
            }
            check_text(equals + 2, end);
            const std::string value(text.substr(equals + 2, end - equals - 2));
            if (value.find('<') != std::string::npos ||
                !element.attributes.emplace(key, value).second) {
                fail_at(at, "bad or repeated attribute");
            }
            at = end + 1;
        }
        if (!ends) {
            open.push_back(elements.size());
        }
        elements.push_back(std::move(element));
    }
    if (!open.empty()) {
        throw std::runtime_error("no end of " + elements[open.back()].name);
    }
    return elements;
}

} // namespace farfield::test
