#pragma once
// What a job is to do, as whoever asks for it says, and as the list of jobs keeps it.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/services/jobs/job.h"
#include "terrain/base/result.h"

namespace tind::services {

/// What is to be done: words for the program that the daemon is, and files.
struct JobOrder {
  std::string process;
  std::string client;
  /// In the job's folder, where it also writes its results. No word comes from a client as it was
  /// sent.
  std::vector<std::string> arguments;
  std::map<std::string, std::string> files;          // to be there first: name and content
  std::map<std::string, std::string> encoded_files;  // the same, of bytes: content in base64
  /// What a client may be told in place of a text in the program's messages: names for paths.
  std::vector<std::pair<std::string, std::string>> names;
  /// Of the results: what it is called, its file, its media type.
  struct Output {
    std::string name, file, media_type;
  };
  std::vector<Output> outputs;  // those that are wanted
  bool document = false;        // all of them as one JSON, in place of the only one as it is
  /// What files of datasets were when it was accepted (state_of_source()), by path: a daemon that
  /// finds it after a restart knows of no other answers that it would have to agree with.
  std::map<std::string, std::string> sources;
  bool waited_for = false;  // by a client that holds its connection: without that nobody asks
};

/// A text that is another once the file is; empty where there is none on this machine.
std::string state_of_source(const std::string& path);

/// Of Job::order: all but process and client, which the job itself has. Fails with unsupported
/// where a file's name is no UTF-8.
Result<std::string> text_of(const JobOrder&);
/// The order of a job; one without arguments where it cannot be read.
JobOrder order_of(const Job&);
/// Its text without what its program was told and given, which nobody reads once it has ended, and
/// which would make the list, and every look at it, as large as what was sent.
std::string order_when_ended(const Job&);

}  // namespace tind::services
