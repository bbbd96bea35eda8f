#include "nastran/ids.hpp"

#include <algorithm>
#include <limits>

#include "nastran/cards.hpp"
#include "nastran/numbers.hpp"

namespace meshsmooth::formats {

IdIndex::IdIndex(std::span<const std::int64_t> ids) {
  if (ids.empty()) return;
  const auto [least, most] = std::ranges::minmax(ids);
  constexpr std::size_t kSparse = 4;
  if (least >= 0 && static_cast<std::size_t>(most) <= kSparse * ids.size() + 1024) {
    dense_.assign(static_cast<std::size_t>(most) + 1, 0);
    for (std::size_t place = 0; place < ids.size(); ++place) {
      std::uint32_t& entry = dense_[static_cast<std::size_t>(ids[place])];
      if (entry == 0) entry = static_cast<std::uint32_t>(place + 1);
    }
    return;
  }
  rows_.reserve(ids.size());
  for (std::size_t place = 0; place < ids.size(); ++place) rows_.push_back({ids[place], place});
  std::ranges::stable_sort(rows_, {}, &Row::id);
}

std::optional<std::size_t> IdIndex::find(std::int64_t id) const {
  if (rows_.empty()) {
    if (id < 0 || static_cast<std::size_t>(id) >= dense_.size()) return std::nullopt;
    const std::uint32_t entry = dense_[static_cast<std::size_t>(id)];
    return entry == 0 ? std::nullopt : std::optional<std::size_t>(entry - 1);
  }
  const auto found = std::ranges::lower_bound(rows_, id, {}, &Row::id);
  if (found == rows_.end() || found->id != id) return std::nullopt;
  return found->place;
}

void IdIndex::append_range(std::int64_t first, std::int64_t last,
                           std::vector<std::int64_t>& ids) const {
  if (rows_.empty()) {
    last = std::min(last, static_cast<std::int64_t>(dense_.size()) - 1);
    for (std::int64_t id = std::max<std::int64_t>(first, 0); id <= last; ++id) {
      if (dense_[static_cast<std::size_t>(id)] != 0) ids.push_back(id);
    }
    return;
  }
  auto row = std::ranges::lower_bound(rows_, first, {}, &Row::id);
  for (; row != rows_.end() && row->id <= last; ++row) ids.push_back(row->id);
}

bool IdList::add_words(std::span<const std::string_view> words) {
  bool excepting = false;
  bool thru = false;
  for (std::size_t at = 0; at < words.size(); ++at) {
    const std::string word = nastran_capitals(words[at]);
    if (word.empty()) continue;
    if (word == "ALL") {
      ranges_.push_back({0, std::numeric_limits<std::int64_t>::max(), 1});
    } else if (word == "THRU") {
      if (ranges_.empty()) return false;
      thru = true;
    } else if (word == "EXCEPT") {
      excepting = true;
    } else if (word == "BY" && at + 1 < words.size()) {
      const auto step = parse_nastran_integer(words[++at]);
      if (!step || *step < 1 || ranges_.empty()) return false;
      ranges_.back().step = *step;
    } else {
      const auto id = parse_nastran_integer(word);
      if (!id || *id < 0) return false;
      excepting = excepting && !ranges_.empty() && *id <= ranges_.back().last;
      if (excepting) {
        exceptions_.push_back(*id);
      } else if (thru) {
        ranges_.back().last = *id;
      } else {
        add(*id);
      }
      thru = false;
    }
  }
  return true;
}

std::vector<std::int64_t> IdList::ids_in(const IdIndex& index) const {
  std::vector<std::int64_t> all;
  std::vector<std::int64_t> found;
  for (const auto& [first, last, step] : ranges_) {
    found.clear();
    index.append_range(first, last, found);
    for (const std::int64_t id : found) {
      if ((id - first) % step == 0) all.push_back(id);
    }
  }
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  std::vector<std::int64_t> exceptions = exceptions_;
  std::ranges::sort(exceptions);
  std::erase_if(all, [&](std::int64_t id) { return std::ranges::binary_search(exceptions, id); });
  return all;
}

}  // namespace meshsmooth::formats
