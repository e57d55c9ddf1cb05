// HTTP, spoken by GDAL, which brings libcurl along. Its handle of a session may be used by one
// thread at a time, so there are as many sessions as threads ask at once.

#include <cpl_conv.h>
#include <cpl_http.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <cpl_vsi_virtual.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "terrain/raster/gdal/gdal_setup.h"
#include "terrain/raster/url_reader.h"

namespace tind {

namespace {

constexpr std::size_t kLargestFetch = 64u << 20;
constexpr int kTries = 20;  // at a server that says that it was asked too often
/// By these names GDAL's file systems of other machines go.
constexpr const char* kRemote[] = {"adls", "az", "curl", "gs", "hdfs", "oss", "s3", "swift"};

/// The name of a session that nobody else uses now.
class Session {
 public:
  Session() {
    const std::lock_guard lock(mutex());
    auto& names = free();
    if (names.empty()) {
      name_ = "tind-" + std::to_string(count()++);
    } else {
      name_ = std::move(names.back());
      names.pop_back();
    }
  }
  ~Session() {
    const std::lock_guard lock(mutex());
    free().push_back(std::move(name_));
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  const std::string& name() const { return name_; }

 private:
  static std::mutex& mutex() {
    static std::mutex m;
    return m;
  }
  static std::vector<std::string>& free() {
    static std::vector<std::string> names;
    return names;
  }
  static int& count() {
    static int n = 0;
    return n;
  }
  std::string name_;
};

thread_local bool we_fetch = false;

/// Instead of GDAL's own fetching; null: as without this. A GeoJSON may name its CRS by a URL.
CPLHTTPResult* refuse(const char*, CSLConstList, GDALProgressFunc, void*, CPLHTTPFetchWriteFunc,
                      void*, void*) {
  if (we_fetch) return nullptr;
  auto* const refused = static_cast<CPLHTTPResult*>(CPLCalloc(1, sizeof(CPLHTTPResult)));
  refused->nStatus = 1;
  refused->pszErrBuf = CPLStrdup("what a file names is not fetched");
  return refused;
}

/// The file systems of GDAL that speak to other machines: whoever names a file of theirs (a VRT, a
/// GeoPackage) finds none. CPL_VSIL_CURL_ALLOWED_FILENAME would not do: /vsicurl_streaming/ asks
/// the server before it looks at it.
void refuse_remote_files() {
  VSIFilesystemPluginCallbacksStruct* const none = VSIAllocFilesystemPluginCallbacksStruct();
  none->open = [](void*, const char*, const char*) -> void* { return nullptr; };
  none->stat = [](void*, const char*, VSIStatBufL*, int) { return -1; };
  // For ever: a handler keeps its prefix's address, and those replaced would be leaks.
  static auto* const replaced = new std::vector<VSIFilesystemHandler*>;
  static auto& every = *new CPLStringList(VSIGetFileSystemsPrefixes());
  every.AddString("/vsicurl?");  // GDAL leaves it out
  for (int i = 0; i < every.size(); ++i) {
    const auto named_in = [&](const char* part) { return std::strstr(every[i], part) != nullptr; };
    if (std::ranges::none_of(kRemote, named_in)) continue;
    replaced->push_back(VSIFileManager::GetHandler(every[i]));
    VSIInstallPluginHandler(every[i], none);
  }
  VSIFreeFilesystemPluginCallbacksStruct(none);
}

using Fetched = std::unique_ptr<CPLHTTPResult, decltype(&CPLHTTPDestroyResult)>;

Fetched fetch(const std::string& url, const CPLStringList& options) {
  we_fetch = true;
  Fetched reply(CPLHTTPFetch(url.c_str(), options.List()), &CPLHTTPDestroyResult);
  we_fetch = false;
  return reply;
}

/// For how long a server that counts requests wants to be left alone; nothing where it does not.
std::optional<std::chrono::seconds> asked_to_wait(const CPLHTTPResult* reply) {
  const std::string_view why = reply && reply->pszErrBuf ? reply->pszErrBuf : "";
  if (!why.ends_with(": 429")) return {};
  const char* const said = CSLFetchNameValue(reply->papszHeaders, "Retry-After");
  return std::chrono::seconds(std::clamp(said ? std::atoi(said) : 1, 1, 30));
}

class GdalUrlReader : public UrlReader {
 public:
  Result<std::vector<std::uint8_t>> read(const std::string& url, const std::string& accept,
                                         const std::string& key) const override;
};

Result<std::vector<std::uint8_t>> GdalUrlReader::read(const std::string& url,
                                                      const std::string& accept,
                                                      const std::string& key) const {
  gdal::set_up();
  const gdal::Complaints complaints;
  const Session session;
  CPLStringList options;
  options.SetNameValue("PERSISTENT", session.name().c_str());
  // libcurl leaves a field of this name out where it is sent on to another host.
  const std::string bearer = key.empty() ? "" : "\r\nAuthorization: Bearer " + key;
  options.SetNameValue("HEADERS", ("Accept: " + accept + bearer).c_str());
  options.SetNameValue("TIMEOUT", "30");
  options.SetNameValue("CONNECTTIMEOUT", "10");
  options.SetNameValue("MAX_FILE_SIZE", std::to_string(kLargestFetch).c_str());
  Fetched reply = fetch(url, options);
  for (int tries = 1; tries < kTries; ++tries) {
    const auto pause = asked_to_wait(reply.get());
    if (!pause) break;
    std::this_thread::sleep_for(*pause);
    reply = fetch(url, options);
  }
  if (!reply) return fail(Errc::io, url + ": " + complaints.text("cannot be fetched"));
  if (reply->nStatus != 0 || reply->pszErrBuf) {
    const std::string why = reply->pszErrBuf ? reply->pszErrBuf : complaints.text("no answer");
    const bool missing = why.ends_with(": 404") || why.ends_with(": 410");
    const bool closed = why.ends_with(": 401") || why.ends_with(": 403");
    return fail(missing ? Errc::not_found : Errc::io,
                url + ": " + why +
                    (!closed       ? ""
                     : key.empty() ? "; a key is taken from TIND_KEY"
                                   : "; the key in TIND_KEY does not open it"));
  }
  return std::vector<std::uint8_t>(reply->pabyData, reply->pabyData + reply->nDataLen);
}

}  // namespace

void gdal::refuse_fetches() {
  CPLHTTPSetFetchCallback(refuse, nullptr);
  refuse_remote_files();
}

const UrlReader& gdal_url_reader() {
  static const GdalUrlReader reader;
  return reader;
}

}  // namespace tind
