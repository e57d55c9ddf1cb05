#include "tests/support/watched_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <tuple>

namespace tind::test {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kSector = 512;

/// What is left of a file that was `old` when it was last synced and is `now`.
std::string left_of(const std::string& now, const std::optional<std::string>& old,
                    std::mt19937& random) {
  if (old && *old == now) return now;
  switch (random() % 6) {
    case 0:
      return now;
    case 1:
      return old.value_or("");
    case 2:
      return now.substr(0, random() % (now.size() + 1));
    case 3:
      return old ? *old : std::string(now.size(), '\0');
    default: {
      std::string torn = now;
      for (std::size_t at = 0; at < torn.size(); at += kSector) {
        if (random() % 2) continue;
        for (std::size_t i = at; i < std::min(at + kSector, torn.size()); ++i)
          torn[i] = old && i < old->size() ? (*old)[i] : '\0';
      }
      return torn;
    }
  }
}

std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts;
  for (const fs::path& part : fs::path(path)) parts.push_back(part.string());
  return parts;
}

}  // namespace

/// Names and contents, as everybody sees them and as they are on the disk.
class WatchedFiles::Disk {
 public:
  using Name = std::pair<int, std::string>;  // in a folder

  Disk() { nodes_.push_back({.folder = true}); }

  void make_folder(const std::string& path) {
    int at = 0;
    for (const std::string& part : parts_of(path)) {
      const Name name{at, part};
      if (!now_.contains(name)) {
        nodes_.push_back({.folder = true});
        change({{name, int(nodes_.size()) - 1}});
      }
      at = now_.at(name);
    }
  }
  void write(const std::string& path, const std::string& bytes) {
    const Name name = name_of(path);
    if (!now_.contains(name)) {
      nodes_.push_back({});
      change({{name, int(nodes_.size()) - 1}});
    }
    node(path).now = bytes;
  }
  void write_at(const std::string& path, std::uint64_t at, const std::string& bytes) {
    std::string& now = node(path).now;
    if (now.size() < at + bytes.size()) now.resize(at + bytes.size());
    now.replace(at, bytes.size(), bytes);
  }
  void rename(const std::string& from, const std::string& to) {
    const Name a = name_of(from), b = name_of(to);
    change({{b, now_.at(a)}, {a, -1}});
  }
  void remove(const std::string& path) {
    const Name name = name_of(path);
    if (now_.contains(name)) change({{name, -1}});
  }
  void sync_file(const std::string& path) {
    Node& n = node(path);
    n.synced = n.now;
  }
  void sync_folder(const std::string& path) {
    const int folder = find(path);
    std::erase_if(pending_, [&](const Change& c) {
      const bool here =
          std::ranges::any_of(c, [&](const auto& entry) { return entry.first.first == folder; });
      if (here) apply(c, synced_);
      return here;
    });
  }
  void sync_all() {
    for (Node& n : nodes_)
      if (!n.folder) n.synced = n.now;
    synced_ = now_;
    pending_.clear();
  }

  void leave(std::mt19937& random, const std::string& to) const {
    std::map<Name, int> names = synced_;
    const unsigned share = random() % 5;  // of what is not synced: nothing to everything
    for (const Change& c : pending_)
      if (random() % 4 < share) apply(c, names);
    write_below(0, names, random, to);
  }

 private:
  struct Node {
    bool folder = false;
    std::string now{};
    std::optional<std::string> synced{};
  };
  using Change = std::vector<std::pair<Name, int>>;  // -1: no such name any more

  static void apply(const Change& change, std::map<Name, int>& names) {
    for (const auto& [name, node] : change) {
      if (node < 0)
        names.erase(name);
      else
        names[name] = node;
    }
  }
  void change(const Change& c) {
    apply(c, now_);
    pending_.push_back(c);
  }
  int find(const std::string& path) const {
    int at = 0;
    for (const std::string& part : parts_of(path)) at = now_.at({at, part});
    return at;
  }
  Name name_of(const std::string& path) const {
    const fs::path p(path);
    return {find(p.parent_path().string()), p.filename().string()};
  }
  Node& node(const std::string& path) { return nodes_[std::size_t(find(path))]; }

  void write_below(int folder, const std::map<Name, int>& names, std::mt19937& random,
                   const std::string& to) const {
    fs::create_directories(to);
    for (auto it = names.lower_bound({folder, ""}); it != names.end() && it->first.first == folder;
         ++it) {
      const Node& n = nodes_[std::size_t(it->second)];
      const std::string path = to + "/" + it->first.second;
      if (n.folder)
        write_below(it->second, names, random, path);
      else
        std::ofstream(path, std::ios::binary) << left_of(n.now, n.synced, random);
    }
  }

  std::vector<Node> nodes_;
  std::map<Name, int> now_, synced_;
  std::vector<Change> pending_;
};

WatchedFiles::WatchedFiles(const std::string& root) : root_(root) {
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    const std::string path = relative(entry.path().string());
    if (entry.is_directory()) {
      begin_folders_.push_back(path);
    } else {
      std::ifstream in(entry.path(), std::ios::binary);
      begin_files_[path] = {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }
  }
}

std::string WatchedFiles::relative(const std::string& path) const {
  if (path == root_) return "";
  if (!path.starts_with(root_ + "/")) throw std::logic_error(path + " is not watched");
  return path.substr(root_.size() + 1);
}

template <class F>
Result<void> WatchedFiles::done(Step step, F&& really) {
  const std::lock_guard lock(mutex_);
  auto result = really();
  if (result) steps_.push_back(std::move(step));
  return result;
}

Result<void> WatchedFiles::make_folder(const std::string& path) {
  return done({Step::Kind::folder, relative(path), {}, 0},
              [&] { return FolderFiles::make_folder(path); });
}
Result<void> WatchedFiles::write(const std::string& path, std::string_view bytes) {
  return done({Step::Kind::write, relative(path), std::string(bytes), 0},
              [&] { return FolderFiles::write(path, bytes); });
}
Result<void> WatchedFiles::write_at(const std::string& path, std::uint64_t at,
                                    std::string_view bytes) {
  return done({Step::Kind::write_at, relative(path), std::string(bytes), at},
              [&] { return FolderFiles::write_at(path, at, bytes); });
}
Result<void> WatchedFiles::rename(const std::string& from, const std::string& to) {
  return done({Step::Kind::rename, relative(from), relative(to), 0},
              [&] { return FolderFiles::rename(from, to); });
}
Result<void> WatchedFiles::remove(const std::string& path) {
  return done({Step::Kind::remove, relative(path), {}, 0},
              [&] { return FolderFiles::remove(path); });
}
Result<void> WatchedFiles::sync_file(const std::string& path) {
  return done({Step::Kind::sync_file, relative(path), {}, 0},
              [&] { return FolderFiles::sync_file(path); });
}
Result<void> WatchedFiles::sync_folder(const std::string& path) {
  return done({Step::Kind::sync_folder, relative(path), {}, 0},
              [&] { return FolderFiles::sync_folder(path); });
}
Result<void> WatchedFiles::sync_all(const std::string& folder) {
  // What is synced is a matter of the model: the real disk keeps its power.
  return done({Step::Kind::sync_all, relative(folder), {}, 0}, [] { return Result<void>(); });
}

void WatchedFiles::leave(std::size_t steps, std::mt19937& random, const std::string& to) const {
  Disk disk;
  for (const std::string& folder : begin_folders_) disk.make_folder(folder);
  for (const auto& [path, bytes] : begin_files_) disk.write(path, bytes);
  disk.sync_all();
  for (std::size_t i = 0; i < steps; ++i) {
    const Step& s = steps_[i];
    switch (s.kind) {
      case Step::Kind::folder:
        disk.make_folder(s.path);
        break;
      case Step::Kind::write:
        disk.write(s.path, s.other);
        break;
      case Step::Kind::write_at:
        disk.write_at(s.path, s.at, s.other);
        break;
      case Step::Kind::rename:
        disk.rename(s.path, s.other);
        break;
      case Step::Kind::remove:
        disk.remove(s.path);
        break;
      case Step::Kind::sync_file:
        disk.sync_file(s.path);
        break;
      case Step::Kind::sync_folder:
        disk.sync_folder(s.path);
        break;
      case Step::Kind::sync_all:
        disk.sync_all();
        break;
    }
  }
  disk.leave(random, to);
}

}  // namespace tind::test
