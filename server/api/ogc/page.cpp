// All scalars of an object become rows of one table, those of objects in it, too; lists of objects
// become sections below it, of alike ones a table with a column for each member.

#include "server/api/ogc/page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "proto/json_text.h"
#include "proto/text_put.h"

namespace tind::api::ogc {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr std::string_view kHead = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'">
<link rel="icon" href="data:,">
<style>
:root { color-scheme: light dark; --ink: #1d2733; --soft: #5b6876; --paper: #fafaf7; --card: #fff; --line: #d9dde0; --accent: #2f6690; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6ebf0; --soft: #9aa7b4; --paper: #12171d; --card: #1a2129; --line: #2f3a45; --accent: #8cc0ea; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 60rem; padding: 1rem; background: var(--paper); color: var(--ink); font: 16px/1.5 system-ui, "Segoe UI", "Helvetica Neue", "DejaVu Sans", sans-serif; overflow-wrap: anywhere; }
a { color: var(--accent); }
nav { color: var(--soft); font-size: .9rem; }
h1 { margin: .4rem 0 .2rem; font-size: 1.6rem; }
h2 { margin: 1.6rem 0 .5rem; font-size: 1.15rem; }
section section { margin: .8rem 0; padding: .6rem .9rem; background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
section section h2 { margin: 0 0 .3rem; font-size: 1rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .6rem .3rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid var(--line); }
th { color: var(--soft); font-weight: 500; }
th[scope=row] { width: 34%; }
@media (max-width: 32rem) {
th[scope=row], th[scope=row] + td { display: block; width: auto; }
th[scope=row] { padding-bottom: 0; border: 0; }
th[scope=row] + td { padding-top: 0; }
}
.wide th { white-space: nowrap; padding-right: 1rem; }
.wide td { overflow-wrap: normal; }
ul { margin: .3rem 0; padding-left: 1.2rem; }
small { color: var(--soft); }
</style>
)";

std::string escaped(std::string_view text) { return proto::text::xml_text(text); }

/// A scalar, as text for a person.
std::string words_of(const Ordered& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_null()) return "none";
  return json::to_text(value);
}

bool is_scalar(const Ordered& value) { return !value.is_structured(); }

/// A scalar, or a list of such (also of lists of such): what goes into one cell of a table.
bool is_cell(const Ordered& value, int depth = 0) {
  if (is_scalar(value)) return true;
  return value.is_array() && depth < 2 &&
         std::ranges::all_of(value, [&](const Ordered& one) { return is_cell(one, depth + 1); });
}

/// "domainSet": for programs alone.
bool is_for_programs(std::string_view name) {
  constexpr std::string_view kNames[] = {"links",     "title",        "description",    "domainSet",
                                         "rangeType", "data_queries", "parameter_names"};
  return std::ranges::find(kNames, name) != std::end(kNames);
}

class Page {
 public:
  explicit Page(const PagePlace& place) : place_(place) {}

  std::string make(const Ordered& document) {
    const std::string title = title_of(document);
    out_ = kHead;
    out_ += "<title>" + escaped(title) + " - tind</title>\n</head>\n<body>\n";
    put_way();
    out_ += "<main>\n<h1>" + escaped(title) + "</h1>\n";
    if (const auto said = document.find("description"); said != document.end())
      out_ += "<p>" + escaped(words_of(*said)) + "</p>\n";
    put_table(document);
    put_sections(document);
    if (const auto links = document.find("links"); links != document.end()) put_links(*links);
    return out_ + "</main>\n</body>\n</html>\n";
  }

 private:
  const PagePlace& place_;
  std::string out_;

  static constexpr int kDeepest = 6;  // objects in each other; what is deeper is left out

  std::string title_of(const Ordered& document) const {
    for (const char* name : {"title", "id"})
      if (const auto found = document.find(name); found != document.end()) return words_of(*found);
    const std::string last = place_.path.substr(place_.path.rfind('/') + 1);
    return last.empty() ? "tind" : last;
  }

  /// "tind / collections / alps"
  void put_way() {
    out_ += "<nav aria-label=\"Way\"><a href=\"/?f=html\">tind</a>";
    for (std::size_t at = 1; at < place_.path.size();) {
      const std::size_t end = std::min(place_.path.find('/', at), place_.path.size());
      out_ += " / ";
      put_anchor(place_.origin + place_.path.substr(0, end) + "?f=html",
                 place_.path.substr(at, end - at));
      at = end + 1;
    }
    out_ += "</nav>\n";
  }

  void put_anchor(const std::string& href, const std::string& text) {
    const bool path = href.starts_with('/') && !href.starts_with("//");
    const bool here = path || href.starts_with(place_.origin + "/");
    if (here)
      out_ += "<a href=\"" + escaped(path ? href : href.substr(place_.origin.size())) + "\">";
    out_ += escaped(text);
    if (here) out_ += "</a>";
  }

  void put_cell(const Ordered& value) {
    constexpr std::size_t kShort = 60;
    if (is_scalar(value)) {
      out_ += escaped(words_of(value));
    } else if (value.size() <= 1 || !value[0].is_string() || json::to_text(value).size() < kShort) {
      for (std::size_t i = 0; i < value.size(); ++i) {
        if (i > 0) out_ += ", ";
        put_cell(value[i]);
      }
    } else {
      out_ += "<ul>";
      for (const Ordered& one : value) out_ += "<li>" + escaped(words_of(one)) + "</li>";
      out_ += "</ul>";
    }
  }

  /// Rows of a table that is open: also those of objects in it, named "extent / spatial / crs".
  void put_rows(const Ordered& object, const std::string& before, int depth) {
    for (const auto& [name, value] : object.items()) {
      if (is_for_programs(name)) continue;
      const std::string whole = before.empty() ? name : before + " / " + name;
      if (is_cell(value))
        put_row(whole, value);
      else if (value.is_object() && depth < kDeepest)
        put_rows(value, whole, depth + 1);
    }
  }

  void put_row(const std::string& name, const Ordered& value) {
    out_ += "<tr><th scope=\"row\">" + escaped(name) + "</th><td>";
    put_cell(value);
    out_ += "</td></tr>\n";
  }

  void put_table(const Ordered& object) {
    const std::size_t before = out_.size();
    out_ += "<table>\n";
    const std::size_t empty = out_.size();
    put_rows(object, "", 0);
    if (out_.size() == empty)
      out_.resize(before);
    else
      out_ += "</table>\n";
  }

  /// Lists of things that are no cells, each a section of its own.
  void put_sections(const Ordered& object) {
    for (const auto& [name, value] : object.items()) {
      if (is_for_programs(name) || !value.is_array() || is_cell(value)) continue;
      out_ += "<section>\n<h2>" + escaped(name) + "</h2>\n";
      if (const auto columns = columns_of(value); !columns.empty())
        put_columns(value, columns);
      else
        put_cards(value);
      out_ += "</section>\n";
    }
  }

  /// The members of the first, where all are objects of the same that have no links of their own;
  /// more than one.
  static std::vector<std::string> columns_of(const Ordered& list) {
    std::vector<std::string> names;
    for (const Ordered& one : list) {
      if (!one.is_object() || one.contains("links")) return {};
      std::vector<std::string> ours;
      for (const auto& [name, value] : one.items()) {
        if (!is_cell(value)) return {};
        ours.push_back(name);
      }
      if (names.empty()) names = ours;
      if (ours != names) return {};
    }
    return list.size() > 1 ? names : std::vector<std::string>();
  }

  void put_columns(const Ordered& list, const std::vector<std::string>& names) {
    out_ += "<div class=\"wide\"><table>\n<tr>";
    for (const std::string& name : names) out_ += "<th scope=\"col\">" + escaped(name) + "</th>";
    out_ += "</tr>\n";
    for (const Ordered& one : list) {
      out_ += "<tr>";
      for (const std::string& name : names) {
        out_ += "<td>";
        put_cell(one[name]);
        out_ += "</td>";
      }
      out_ += "</tr>\n";
    }
    out_ += "</table></div>\n";
  }

  /// Each a card; one that has a link to itself leads there.
  void put_cards(const Ordered& list) {
    for (const Ordered& one : list) {
      out_ += "<section>\n";
      if (one.is_object()) put_card_head(one);
      if (one.is_object())
        put_table(one);
      else
        out_ += "<p>" + escaped(words_of(one)) + "</p>";
      out_ += "</section>\n";
    }
  }

  void put_card_head(const Ordered& one) {
    if (!one.contains("title") && !one.contains("id")) return;
    std::string self;
    if (const auto links = one.find("links"); links != one.end())
      for (const Ordered& l : *links)
        if (l.value("rel", "") == "self") self = l.value("href", "");
    out_ += "<h2>";
    put_anchor(self, title_of(one));
    out_ += "</h2>\n";
    if (const auto said = one.find("description"); said != one.end())
      out_ += "<p>" + escaped(words_of(*said)) + "</p>\n";
  }

  void put_links(const Ordered& links) {
    out_ += "<section>\n<h2>links</h2>\n<ul>\n";
    for (const Ordered& l : links) {
      const std::string href = l.value("href", ""), title = l.value("title", "");
      out_ += "<li>";
      if (l.value("templated", false))  // no address yet
        out_ += escaped(title) + "<br><small>" + escaped(href) + "</small>";
      else
        put_anchor(href, title.empty() ? href : title);
      out_ += " <small>" + escaped(l.value("type", "")) + "</small></li>\n";
    }
    out_ += "</ul>\n</section>\n";
  }
};

}  // namespace

std::string page_of(const Ordered& document, const PagePlace& place) {
  return Page(place).make(document);
}

}  // namespace tind::api::ogc
