#pragma once

#include "content.hpp"
#include "msh/msh_content.hpp"

namespace meshsmooth::formats {

/// Physical groups, geometrical entities and ids of the file as columns and groups. O(elements).
void add_msh_groups(const MshContent& file, PlainDataset& dataset, FileContent& content);

}  // namespace meshsmooth::formats
