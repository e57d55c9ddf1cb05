#include "server/services/metrics.h"

#include <dirent.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <memory>

#include "server/log/log.h"
#include "terrain/raster/sandbox/decoder.h"

namespace tind::services {
namespace {

/// Writes metrics one after the other, each with its HELP and TYPE.
class Exposition {
 public:
  void begin(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
  }
  template <class Number>
  void value(Number number, std::string_view labels = {}, std::string_view suffix = {}) {
    text_ += fmt::format("{}{}{}{}{} {}\n", name_, suffix, labels.empty() ? "" : "{", labels,
                         labels.empty() ? "" : "}", number);
  }
  template <class Number>
  void one(std::string_view name, std::string_view type, std::string_view help, Number number) {
    begin(name, type, help);
    value(number);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string_view name_;
  std::string text_;
};

void http_metrics(Exposition& out, const http::StatsSnapshot& stats) {
  out.begin("tind_http_requests_total", "counter", "Responses by class of status.");
  for (std::size_t i = 2; i < stats.by_class.size(); ++i)
    out.value(stats.by_class[i], fmt::format("code=\"{}xx\"", i));
  out.begin("tind_http_request_duration_seconds", "histogram",
            "From a request's last head byte to its response being queued.");
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < stats.durations.size(); ++i) {
    sum += stats.durations[i];
    const std::string bound = i < http::kDurationBounds.size()
                                  ? fmt::format("{}", http::kDurationBounds[i])
                                  : std::string("+Inf");
    out.value(sum, "le=\"" + bound + "\"", "_bucket");
  }
  out.value(stats.duration_sum_s, {}, "_sum");
  out.value(sum, {}, "_count");
  out.one("tind_http_connections", "gauge", "Open connections.", stats.connections);
  out.one("tind_http_connections_accepted_total", "counter", "Connections accepted.",
          stats.accepted);
  out.one("tind_http_sent_bytes_total", "counter", "Bytes written to clients.", stats.bytes_sent);
  out.one("tind_http_held_bytes", "gauge", "Request bodies, and responses on their way, in memory.",
          stats.held_bytes);
  out.one("tind_http_held_bytes_limit", "gauge", "What they may take together.", stats.held_limit);
  out.begin("tind_http_rejected_total", "counter", "Requests and clients refused, by reason.");
  for (const auto& [reason, count] : stats.rejected) out.value(count, "reason=\"" + reason + "\"");
}

void catalog_metrics(Exposition& out, const Catalog& catalog, const CatalogKeeper* keeper) {
  out.one("tind_datasets", "gauge", "Datasets served.", catalog.all().size());
  const auto status = keeper ? keeper->status() : CatalogKeeper::Status{};
  out.one("tind_datasets_changed", "gauge", "Of these, those whose files are not as they were.",
          status.unlike.size());
  out.one("tind_datasets_unread", "gauge",
          "Of these, those whose heights could not be made ready when that was tried last.",
          status.unread.size());
  out.one("tind_decoders_failed_total", "counter",
          "Processes that read DEMs which died, answered nonsense or took too long.",
          sandbox::decoders_failed());
  out.begin("tind_reloads_total", "counter", "Readings of the configuration since the start.");
  out.value(status.reloads, "result=\"ok\"");
  out.value(status.failed_reloads, "result=\"failed\"");
}

void tile_metrics(Exposition& out, const TileService& service, const TileCache& cache) {
  const auto& counters = service.counters();
  out.begin("tind_tile_requests_total", "counter", "Requests for existing tiles, by outcome.");
  out.value(counters.hits.load(), "result=\"hit\"");
  out.value(counters.joined.load(), "result=\"joined\"");
  out.value(counters.refused.load(), "result=\"refused\"");
  out.begin("tind_tile_build_duration_seconds", "summary", "Making or reading one tile.");
  out.value(double(counters.build_nanoseconds.load()) * 1e-9, {}, "_sum");
  out.value(counters.built.load(), {}, "_count");
  out.one("tind_tile_build_failures_total", "counter", "Tiles that could not be made.",
          counters.failed.load());
  out.one("tind_tile_build_repeated_failures_total", "counter",
          "Requests answered with a tile's failure of a moment ago.", counters.failed_again.load());
  out.one("tind_cache_bytes", "gauge", "Memory held by finished tiles.", cache.bytes());
  out.one("tind_cache_tiles", "gauge", "Finished tiles, and what is made of them, in memory.",
          cache.tiles());
  out.one("tind_cache_evictions_total", "counter", "Tiles that made room for others.",
          cache.evictions());
}

void work_metrics(Exposition& out, const CpuPool& pool) {
  const auto each = [&](std::string_view metric, std::string_view type, std::string_view help,
                        auto&& value) {
    out.begin(metric, type, help);
    for (const Work work : kWorks) out.value(value(work), fmt::format("class=\"{}\"", name(work)));
  };
  each("tind_work_tasks", "gauge", "Tasks waiting or running, by class.",
       [&](Work work) { return pool.admitted(work); });
  each("tind_work_capacity", "gauge", "Tasks that may wait or run.",
       [&](Work work) { return pool.capacity(work); });
  each("tind_work_refused_total", "counter", "Tasks refused because there were too many.",
       [&](Work work) { return pool.refused(work); });
  each("tind_work_abandoned_total", "counter", "Tasks ended because nobody waited for them.",
       [&](Work work) { return pool.abandoned(work); });
}

void product_metrics(Exposition& out, std::span<const NamedProducts> products) {
  const auto each = [&](auto&& f) {
    for (const auto& [name, made] : products)
      if (made) f(fmt::format("product=\"{}\"", name), made->counters());
  };
  out.begin("tind_product_requests_total", "counter",
            "Requests for what is made of existing tiles, by outcome.");
  each([&](const std::string& label, const TileProducts::Counters& counters) {
    out.value(counters.hits.load(), label + ",result=\"hit\"");
    out.value(counters.joined.load(), label + ",result=\"joined\"");
    out.value(counters.refused.load(), label + ",result=\"refused\"");
  });
  out.begin("tind_product_build_duration_seconds", "summary",
            "Making one, with its tiles where they were not there.");
  each([&](const std::string& label, const TileProducts::Counters& counters) {
    out.value(double(counters.build_nanoseconds.load()) * 1e-9, label, "_sum");
    out.value(counters.built.load(), label, "_count");
  });
  out.begin("tind_product_build_failures_total", "counter", "Those that could not be made.");
  each([&](const std::string& label, const TileProducts::Counters& counters) {
    out.value(counters.failed.load(), label);
  });
}

void job_metrics(Exposition& out, const Jobs& jobs) {
  const Jobs::Counts counts = jobs.counts();
  out.begin("tind_jobs", "gauge", "Jobs that have not ended.");
  out.value(counts.waiting, "state=\"waiting\"");
  out.value(counts.running, "state=\"running\"");
  out.begin("tind_jobs_ended_total", "counter", "Jobs that have ended.");
  out.value(counts.successful, "status=\"successful\"");
  out.value(counts.failed, "status=\"failed\"");
  out.value(counts.dismissed, "status=\"dismissed\"");
}

std::size_t resident_bytes() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "r"),
                                                             std::fclose);
  std::size_t total = 0, resident = 0;
  if (!file || std::fscanf(file.get(), "%zu %zu", &total, &resident) != 2) return 0;
  return resident * std::size_t(sysconf(_SC_PAGESIZE));
}

std::size_t open_descriptors() {
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(opendir("/proc/self/fd"), closedir);
  if (!directory) return 0;
  std::size_t count = 0;
  while (readdir(directory.get())) ++count;  // NOLINT(concurrency-mt-unsafe): nobody else's stream
  return count - std::min<std::size_t>(count, 3);  // ".", ".." and the one for reading
}

void process_metrics(Exposition& out) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + double(t.tv_usec) * 1e-6; };
  out.one("process_cpu_seconds_total", "counter", "User and system time.",
          seconds(usage.ru_utime) + seconds(usage.ru_stime));
  out.one("process_resident_memory_bytes", "gauge", "Resident memory.", resident_bytes());
  out.one("process_open_fds", "gauge", "Open file descriptors.", open_descriptors());
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0)
    out.one("process_max_fds", "gauge", "File descriptors that may be open.",
            std::uint64_t(limit.rlim_cur));
}

}  // namespace

std::string render_metrics(const http::StatsSnapshot& http_stats, const Catalog& catalog,
                           const CatalogKeeper* keeper, const TileService& service,
                           const TileCache& cache, const CpuPool& pool,
                           std::span<const NamedProducts> products, const Jobs* jobs) {
  Exposition out;
  out.begin("tind_build_info", "gauge", "The version that is running.");
  out.value(1, "version=\"" TIND_VERSION "\"");
  catalog_metrics(out, catalog, keeper);
  http_metrics(out, http_stats);
  tile_metrics(out, service, cache);
  work_metrics(out, pool);
  product_metrics(out, products);
  const logging::LogCounts log = logging::log_counts();
  out.one("tind_log_lines_dropped_total", "counter", "Lines that stderr did not take in time.",
          log.dropped);
  out.one("tind_log_lines_repeated_total", "counter", "Warnings that had been written before.",
          log.repeated);
  if (jobs) job_metrics(out, *jobs);
  process_metrics(out);
  return out.take();
}

}  // namespace tind::services
