// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/face_finding.h"

#include <algorithm>
#include <optional>
#include <set>

#include "geometry/error.h"
#include "io/iges/entity.h"
#include "io/iges/topology.h"

namespace toile::iges {

namespace {

// A parameter of a record, the entity type being number 0; nullopt where it is no integer.
std::optional<int> nth_integer(const File& file, const Entry& e, int n) {
  try {
    Parameters in(file, e);
    if (n < in.size()) return parse_integer(in.token(n).text);
  } catch (const InputError&) {
    // The entity itself is quarantined for this, with the message.
  }
  return std::nullopt;
}

// Surfaces that are a face where nobody uses them.
bool stands_alone(const Entry& e) {
  return e.type == 114 || e.type == 118 || e.type == 120 || e.type == 122 || e.type == 128 || e.type == 140 ||
         e.type == 196 || e.type == 198 || (e.type == 108 && e.form == 1);
}

// Surfaces that another entity is made of. Groups and properties don't use what they name.
std::set<int> used_surfaces(const File& file) {
  std::set<int> used;
  std::vector<int> doubtful;  // dependent by their status, though nobody known uses them
  for (const Entry& e : file.entries) {
    int parameter = 0;  // where the pointer to a surface stands
    if (stands_alone(e) && (e.subordinate == 1 || e.subordinate == 3)) doubtful.push_back(e.sequence);
    switch (e.type) {
      case 140:
        parameter = 5;
        break;
      case 144:
      case 510:
        parameter = 1;
        break;
      case 142:
      case 143:
        parameter = 2;
        break;
      case 141:
        parameter = 3;
        break;
      default:
        continue;
    }
    const std::optional<int> pointer = nth_integer(file, e, parameter);
    if (pointer) used.insert(*pointer);
  }
  std::erase_if(doubtful, [&](int sequence) { return used.count(sequence) != 0; });
  if (doubtful.empty()) return used;
  for (const Entry& e : file.entries) {
    if (find_kind(e.type) || e.count == 0) continue;
    Tokens tokens;
    tokenize(file.record(e), file.delimiters, tokens);
    for (const Token& token : tokens.list) {
      const std::optional<int> pointer = token.is_string ? std::nullopt : parse_integer(token.text);
      if (pointer && std::binary_search(doubtful.begin(), doubtful.end(), *pointer)) used.insert(*pointer);
    }
  }
  return used;
}

// An offset of a plane, a cylinder or a cone has no end of its own.
bool endless(const File& file, const Entry& e) {
  if (e.type != 140) return false;
  const Entry* base = &e;
  for (int depth = 0; base && base->type == 140 && depth <= max_depth; ++depth)
    base = file.find(nth_integer(file, *base, 5).value_or(0));
  return base && (base->type == 108 || base->type == 190 || base->type == 192 || base->type == 194);
}

std::vector<int> sequences(const std::vector<Use>& uses) {
  std::vector<int> out;
  for (const Use& use : uses) out.push_back(use.sequence);
  return out;
}

// Faces, surfaces that nobody uses, and what holds such.
void expand(Reading& reading, const std::set<int>& used, const Entry& e, const Eigen::Affine3d& placement, int depth,
            std::vector<PlacedFace>& out) {
  if (depth > max_depth) throw InputError(reading.file.place(e) + "its instances form a cycle");
  if (out.size() > 4 * reading.file.entries.size() + 10000)
    throw InputError(reading.file.place(e) + "its instances are too many");
  if (stands_alone(e)) {
    if (used.count(e.sequence) == 0 && !endless(reading.file, e)) out.push_back({&e, placement});
    return;
  }
  switch (e.type) {
    case 143:
    case 144:
    case 510:
      out.push_back({&e, placement});
      return;
    case 186:
    case 408:
    case 514:
      break;
    case 402:
      if (depth > 0 && is_group(e)) break;  // elsewhere the members stand for themselves
      return;
    default:
      return;
  }
  reading.spend(e);
  Parameters in(reading.file, e, &reading.notes);
  const Entry* holder = &e;
  std::vector<int> members;
  Eigen::Affine3d t = placement;
  if (e.type != 402) t = t * reading.transform(e);
  if (e.type == 186) {
    members = sequences(read_solid(in).shells);
  } else if (e.type == 514) {
    members = sequences(read_shell(in).faces);
  } else if (e.type == 402) {
    members = read_group(in);
  } else {
    const Instance instance = read_instance(in);
    holder = &reading.entry(instance.definition, e, "subfigure definition", 308);
    t = t * iges::placement(instance);
    Parameters definition(reading.file, *holder, &reading.notes);
    members = read_definition(definition).members;
    reading.mark(*holder, Disposition::read);
  }
  for (const int member : members) {
    const Entry& held = e.type == 186   ? reading.entry(member, e, "shell", 514)
                        : e.type == 514 ? reading.entry(member, e, "face", 510)
                                        : reading.entry(member, *holder, "member");
    expand(reading, used, held, t, depth + 1, out);
  }
  reading.mark(e, Disposition::read);
}

}  // namespace

std::vector<PlacedFace> find_faces(Reading& reading) {
  const std::set<int> used = used_surfaces(reading.file);
  std::vector<PlacedFace> out;
  // What a definition, a shell or a solid holds appears where those put it.
  std::set<int> held;
  const auto hold = [&](const std::vector<int>& members) { held.insert(members.begin(), members.end()); };
  const auto read_holder = [&](const Entry& e) {
    Parameters in(reading.file, e);
    if (e.type == 186) return hold(sequences(read_solid(in).shells));
    if (e.type == 514) return hold(sequences(read_shell(in).faces));
    if (e.type == 402) {
      read_group(in);
      return reading.mark(e, Disposition::read);
    }
    for (const int member : read_definition(in).members) {
      held.insert(member);
      // A group within a definition holds its members too.
      const Entry* group = reading.file.find(member);
      if (!group || !is_group(*group)) continue;
      Parameters of_group(reading.file, *group);
      hold(read_group(of_group));
    }
  };
  for (const Entry& e : reading.file.entries) {
    if (e.type != 186 && e.type != 308 && e.type != 514 && !is_group(e)) continue;
    try {
      read_holder(e);
    } catch (const InputError& error) {
      reading.quarantine(e, error.what());
    }
  }
  for (const Entry& e : reading.file.entries) {
    if (held.count(e.sequence) != 0) continue;
    const std::size_t before = out.size();
    try {
      expand(reading, used, e, Eigen::Affine3d::Identity(), 0, out);
    } catch (const InputError& error) {
      out.resize(before, PlacedFace{nullptr, Eigen::Affine3d::Identity()});
      reading.quarantine(e, error.what());
    }
  }
  return out;
}

}  // namespace toile::iges
