#include "set_reader.hpp"

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

namespace meshsmooth::formats {

bool SetReader::read_set(const DeckKeyword& keyword, Kind kind, ScopeId own) {
  const std::string name = keyword.value(kind == Kind::nodes ? "NSET" : "ELSET");
  if (name.empty()) reader_.fail_at(keyword.place, "expected the name of the set");
  ScopeId scope = own;
  if (const std::string instance = keyword.value("INSTANCE"); !instance.empty()) {
    const auto* known = model_.find_instance(instance);
    if (known == nullptr) {
      reader_.fail_at(keyword.place, "there is no instance \"" + instance + "\"");
    }
    scope = *known;
  }
  model_.add_set(own, kind, name);
  const std::string elements = keyword.value("ELSET");
  if (kind == Kind::nodes && !elements.empty()) {
    model_.add_to_set(own, kind, name, {Kind::elements, scope, false, {}, elements, keyword.place});
  }
  const bool generate = keyword.find("GENERATE") != nullptr;
  while (true) {
    if (!reader_.next()) return false;
    if (reader_.at_keyword()) return true;
    split_data(reader_.line(), words_);
    if (generate) {
      model_.add_to_set(own, kind, name, {kind, scope, true, read_range(), {}, reader_.place()});
      continue;
    }
    for (const std::string_view word : words_) {
      if (!trimmed(word).empty()) {
        model_.add_to_set(own, kind, name, read_member(trimmed(word), kind, scope));
      }
    }
  }
}

bool SetReader::read_surface(const DeckKeyword& keyword, ScopeId scope) {
  const std::string name = keyword.value("NAME"), type = in_capitals(keyword.value("TYPE"));
  while (true) {
    if (!reader_.next()) return false;
    if (reader_.at_keyword()) return true;
    split_data(reader_.line(), words_);
    if (name.empty() || (!type.empty() && type != "ELEMENT") || words_.size() < 2) continue;
    const std::string side = in_capitals(trimmed(words_[1]));
    const std::string_view of = trimmed(words_.front());
    const bool edge = side.starts_with('E');
    const bool numbered = side.size() == 2 && side[1] >= '1' && side[1] <= '6';
    if (!numbered || of.empty() || !(edge || side.starts_with('S'))) continue;
    model_.add_to_surface(scope, name, read_member(of, Kind::elements, scope),
                          {side[1] - '0', edge});
  }
}

bool SetReader::read_equations(ScopeId scope) {
  std::size_t left = 0;  // words of the equation
  std::vector<AbaqusModel::Entry> terms;
  const auto end_equation = [&] {
    if (!terms.empty()) model_.add_equation(std::exchange(terms, {}));
  };
  while (true) {
    const bool more = reader_.next();
    if (!more || reader_.at_keyword()) {
      end_equation();
      return more;
    }
    split_data(reader_.line(), words_);
    if (left == 0) {
      end_equation();
      left = 3 * static_cast<std::size_t>(std::max<std::int64_t>(0, term_count()));
      continue;
    }
    for (const std::string_view word : words_) {
      if (left == 0 || trimmed(word).empty()) break;
      if (left-- % 3 == 0) {
        terms.push_back(read_member(trimmed(word), Kind::nodes, scope));
      }
    }
  }
}

std::int64_t SetReader::term_count() const {
  std::int64_t count = 0;
  const std::string_view word = trimmed(words_.front());
  (void)std::from_chars(word.data(), word.data() + word.size(), count);
  return std::min<std::int64_t>(count, std::int64_t{1} << 32);
}

AbaqusModel::Range SetReader::read_range() {
  const std::int64_t first = reader_.label(words_.front());
  const std::int64_t last = words_.size() > 1 ? reader_.label(words_[1]) : first;
  const std::int64_t step = words_.size() > 2 ? reader_.label(words_[2]) : 1;
  if (last < first) reader_.refuse("first, last and step", reader_.line());
  return {first, last, step};
}

AbaqusModel::Entry SetReader::read_member(std::string_view word, Kind kind, ScopeId scope) {
  if (const std::size_t point = word.rfind('.'); point != std::string_view::npos) {
    if (const auto* instance = model_.find_instance(word.substr(0, point))) {
      scope = *instance;
      word.remove_prefix(point + 1);
    }
  }
  if (word.size() > 1 && word.front() == '"' && word.back() == '"') {
    word = word.substr(1, word.size() - 2);
  }
  const bool number = !word.empty() && word.find_first_not_of("0123456789") == std::string::npos;
  if (!number) return {kind, scope, false, {}, std::string(word), reader_.place()};
  const std::int64_t label = reader_.label(word);
  return {kind, scope, false, {label, label, 1}, {}, reader_.place()};
}

}  // namespace meshsmooth::formats
