#include "method_flags.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iterator>
#include <span>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

/// The methods that `belongs` holds of, for an error text.
template <class Belongs>
std::string words_where(const Belongs& belongs) {
  std::string text;
  for (const auto& [word, method] : method_words()) {
    if (belongs(method)) text += (text.empty() ? "" : ", ") + word;
  }
  return text;
}

bool has_flag(const Method& method, std::string_view flag) {
  bool found = false;
  std::visit(
      [&]<class M>(const M&) {
        for_each_field<M>([&](const auto& field) { found = found || field.flag == flag; });
      },
      method);
  return found;
}

[[noreturn]] void throw_misplaced(const SmoothFlags& flags, const std::string& flag,
                                  const std::string& methods) {
  throw InvalidOption(
      "OPTION_MISPLACED",
      flag + " is not an option of --method " + flags.method + "; it belongs to: " + methods,
      {{"field", flag}});
}

/// Refuses flags and forms that the chosen method does not have.
void check_belonging(const SmoothFlags& flags, const Method& method) {
  const auto check = [&](const auto& given) {
    for (const auto& [flag, value] : given) {
      if (has_flag(method, flag)) continue;
      throw_misplaced(flags, flag, words_where([&, &name = flag](const Method& m) {
                        return has_flag(m, name);
                      }));
    }
  };
  check(flags.numbers);
  check(flags.choices);
  const auto has_form = [&](const Method& m) {
    const auto names = forms_of(m);
    return std::ranges::any_of(names,
                               [&](Form form) { return to_word(enum_name(form)) == *flags.form; });
  };
  if (!flags.form || has_form(method)) return;
  throw_misplaced(flags, "--form " + *flags.form, words_where(has_form));
}

/// "0.6307", as short as it can be read back.
std::string number_text(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return error == std::errc() ? std::string(text, end) : std::string();
}

/// Whether the command `move` has a method, else the command `smooth`.
template <class M>
constexpr bool kMoves = std::is_same_v<M, Move>;

}  // namespace

std::string to_word(std::string_view name) {
  std::string word(name);
  std::ranges::replace(word, '_', '-');
  return word;
}

std::vector<std::string> words_of(std::span<const std::string_view> names) {
  std::vector<std::string> words;
  std::ranges::transform(names, std::back_inserter(words), to_word);
  return words;
}

std::string default_method_word() { return to_word(method_name(SmoothOptions{}.method)); }

std::vector<MethodWord> method_words() {
  std::vector<MethodWord> words;
  for_each_method([&](const auto& method) {
    words.push_back({to_word(method_name(method)), method});
  });
  for (const MethodPreset& preset : kMethodPresets)
    words.push_back({std::string(preset.name), preset.method});
  // The default first.
  std::ranges::stable_partition(
      words, [](const MethodWord& w) { return w.word == default_method_word(); });
  return words;
}

Method to_method(const SmoothFlags& flags) {
  const std::vector<MethodWord> words = method_words();
  Method method = std::ranges::find(words, flags.method, &MethodWord::word)->method;
  check_belonging(flags, method);
  std::visit(
      [&]<class M>(M& m) {
        for_each_field<M>([&]<class Field>(const Field& field) {
          const std::string flag(field.flag);
          if constexpr (std::is_same_v<Field, NumberField<M>>) {
            if (const auto given = flags.numbers.find(flag); given != flags.numbers.end()) {
              m.*field.member = given->second;
            }
          } else if (const auto given = flags.choices.find(flag); given != flags.choices.end()) {
            const auto place = std::ranges::find(field.choices, given->second, to_word);
            using Enum = std::remove_reference_t<decltype(m.*field.member)>;
            m.*field.member = static_cast<Enum>(place - field.choices.begin());
          }
        });
      },
      method);
  return method;
}

void add_method_flags(CLI::App& command, SmoothFlags& flags, bool moves) {
  for_each_method([&]<class M>(const M& method) {
    if (kMoves<M> != moves) return;
    for_each_field<M>([&]<class Field>(const Field& field) {
      const std::string flag(field.flag);
      if (flag.empty() || command.get_option_no_throw(flag) != nullptr) return;
      const std::string owners = words_where([&](const Method& m) {
        return std::holds_alternative<Move>(m) == moves && has_flag(m, flag);
      });
      const std::string help =
          moves ? std::string(field.help) : owners + ": " + std::string(field.help);
      if constexpr (std::is_same_v<Field, NumberField<M>>) {
        command.add_option_function<double>(
            flag, [&flags, flag](const double& value) { flags.numbers[flag] = value; },
            help + " [" + number_text(method.*field.member) + "]");
      } else {
        const auto chosen = static_cast<std::size_t>(method.*field.member);
        command
            .add_option_function<std::string>(
                flag, [&flags, flag](const std::string& value) { flags.choices[flag] = value; },
                help + " [" + to_word(field.choices[chosen]) + "]")
            ->check(CLI::IsMember(words_of(field.choices)));
      }
    });
  });
}

}  // namespace meshsmooth::cli
