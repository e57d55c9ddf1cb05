#pragma once
// The folders that jobs lie in: one for all, and in it one for each, named by its id.

#include <cstdint>
#include <string>

#include "server/services/jobs/job_store.h"
#include "terrain/base/result.h"

namespace tind::services {

/// The list of jobs in such a folder.
std::string list_in(const std::string& folder);

/// `folder`, absolute; where it was not there, it is made, for this user alone: whoever has a job's
/// id may see and end it.
Result<std::string> make_jobs_folder(const std::string& folder);

/// One of its own among the system's temporary folders. Those of this user's daemons that were
/// killed go: a list that no daemon holds open is nobody's, and one that is a minute old is not
/// just being made.
Result<std::string> make_temporary_jobs_folder();

/// Removes folders of jobs that the list does not know. Where the list is a new one they may be
/// anybody's, and stay.
void remove_unknown_jobs(const std::string& folder, const JobStore& list);

/// Puts all that a job's folder holds, and the folder, beyond power cuts.
Result<void> sync_results(const std::string& folder);

/// Of the files in a job's folder. Fails where they cannot all be seen: a part of them is no sum.
Result<std::uint64_t> bytes_in(const std::string& folder);

}  // namespace tind::services
