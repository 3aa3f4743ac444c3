// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/iges/cards.h"

#include <charconv>
#include <cmath>

#include "geometry/error.h"
#include "geometry/text.h"

namespace toile::iges {

namespace {

// Right-justified in `width` columns at `at`.
void put_number(std::string& card, std::size_t at, std::size_t width, long long value, char fill = ' ') {
  std::array<char, 24> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  const auto length = static_cast<std::size_t>(end - buffer.data());
  if (length > width) throw OutputError("an IGES counter does not fit into its columns: " + std::to_string(value));
  card.replace(at, width - length, width - length, fill);
  card.replace(at + width - length, length, buffer.data(), length);
}

class Section {
 public:
  Section(std::string& out, char letter) : out_(out), letter_(letter) {}
  void line(std::string_view data) {
    const std::size_t begin = out_.size();
    out_.append(data.substr(0, 72));
    out_.resize(begin + 72, ' ');
    out_ += letter_;
    out_.append(7, '0');
    put_number(out_, begin + 73, 7, ++count_, '0');
    out_ += '\n';
  }
  long long count() const { return count_; }

 private:
  std::string& out_;
  char letter_;
  long long count_ = 0;
};

}  // namespace

std::array<std::string, 2> make_cards(const Card& card) {
  std::array<std::string, 2> out{std::string(72, ' '), std::string(72, ' ')};
  put_number(out[0], 0, 8, card.type);
  put_number(out[0], 16, 8, 0);
  put_number(out[0], 24, 8, 0);
  put_number(out[0], 32, 8, card.level);
  put_number(out[0], 40, 8, 0);
  put_number(out[0], 48, 8, card.transform);
  put_number(out[0], 56, 8, 0);
  out[0].replace(64, 8, card.status, 8);
  put_number(out[1], 0, 8, card.type);
  put_number(out[1], 8, 8, 0);
  put_number(out[1], 16, 8, card.colour);
  put_number(out[1], 32, 8, card.form);
  const std::string_view label(card.label);
  out[1].replace(64 - label.size(), label.size(), label);
  put_number(out[1], 64, 8, 0);
  return out;
}

constexpr std::string_view up_words = "Up in these axes:";

std::string up_line(const Eigen::Vector3d& up) {
  std::string out(up_words);
  for (const double value : up) out += ' ' + text(value);
  return out;
}

std::optional<Eigen::Vector3d> read_up(const std::vector<std::string_view>& start) {
  for (const std::string_view line : start) {
    if (!line.starts_with(up_words)) continue;
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    const char* at = line.data() + up_words.size();
    const char* const end = line.data() + line.size();
    for (double& value : up) {
      while (at < end && *at == ' ') ++at;
      at = std::from_chars(at, end, value).ptr;
    }
    if (std::abs(up.norm() - 1) < 1e-6) return up;
  }
  return std::nullopt;
}

std::string assemble(const std::vector<std::string>& start, std::string_view global,
                     const std::vector<OutRecord>& records) {
  std::size_t lines = start.size() + global.size() / 72 + 2 * records.size() + 2;
  for (const OutRecord& record : records) lines += record.lines.size() / 64;
  std::string out;
  out.reserve(81 * lines);

  Section s(out, 'S'), g(out, 'G'), d(out, 'D'), p(out, 'P');
  for (const std::string& text : start) s.line(text);
  if (start.empty()) s.line("");
  for (std::size_t i = 0; i < global.size(); i += 72) g.line(global.substr(i, 72));
  long long next = 1;
  for (const OutRecord& record : records) {
    const long long count = static_cast<long long>(record.lines.size() / 64);
    std::array<std::string, 2> cards = record.cards;
    for (std::string& card : cards) card.resize(72, ' ');
    put_number(cards[0], 8, 8, count > 0 ? next : 0);
    put_number(cards[1], 24, 8, count);
    d.line(cards[0]);
    d.line(cards[1]);
    next += count;
  }
  std::string data;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const std::string_view text = records[i].lines;
    for (std::size_t at = 0; at < text.size(); at += 64) {
      data.assign(text.substr(at, 64));
      data.resize(72, ' ');
      put_number(data, 65, 7, static_cast<long long>(2 * i + 1));
      p.line(data);
    }
  }
  std::string t;
  for (const auto& [letter, count] :
       {std::pair('S', s.count()), {'G', g.count()}, {'D', d.count()}, {'P', p.count()}}) {
    std::string part(8, '0');
    part[0] = letter;
    put_number(part, 1, 7, count, '0');
    t += part;
  }
  Section(out, 'T').line(t);
  return out;
}

}  // namespace toile::iges
