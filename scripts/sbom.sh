# Sourced after lib.sh: the Debian packages that a build's programs consist of, and SPDX of them.
# shellcheck shell=bash

# linked_packages FILE…: the packages of shared libraries.
linked_packages() {
  local file
  for file in "$@"; do
    file=$(realpath -- "$file")
    # dpkg knows some of /usr/lib under /lib, which is a link to it.
    dpkg-query -S "$file" 2>/dev/null || dpkg-query -S "${file#/usr}" || return 1
  done | cut -d: -f1 | sort -u
}

# compiled_packages BUILD TARGET…: the packages of what is in the programs themselves: archives by
# the commands of the linker, headers by what the compiler has read.
compiled_packages() {
  local build=$1 commands objects
  shift
  commands=$(ninja -C "$build" -t commands "$@")
  mapfile -t objects < <(sed -nE 's/.* -o ([^ ]+\.o)( .*|$)/\1/p' <<<"$commands")
  { # with shared libraries only there may be no archive
    grep -oE '/usr/[^ ]+\.a\b' <<<"$commands" || true
    # Relative to the build where a compiler cache has a base_dir.
    ninja -C "$build" -t deps "${objects[@]}" | sed -n 's/^    //p'
  } | (cd -- "$build" && xargs -r realpath --) | { grep '^/usr/' || true; } | sort -u |
    { xargs -r dpkg-query -S 2>/dev/null || true; } | cut -d: -f1 | sort -u
}

# write_spdx TOOL VERSION NAME: SPDX 2.3 of meshsmooth, VERSION, with the packages of standard
# input, lines "PACKAGE DYNAMIC_LINK" or "PACKAGE STATIC_LINK". NAME tells documents apart. The time
# is SOURCE_DATE_EPOCH (0).
write_spdx() {
  local tool=$1 version=$2 name=$3 distribution package how package_version source source_version
  local reference
  # Debian unstable has no number.
  distribution=$(. /etc/os-release && echo "$ID-${VERSION_ID:-$VERSION_CODENAME}")
  printf '%s\n' 'SPDXVersion: SPDX-2.3' 'DataLicense: CC0-1.0' 'SPDXID: SPDXRef-DOCUMENT' \
    "DocumentName: meshsmooth-$version" \
    "DocumentNamespace: https://meshsmooth.dev/spdx/$version/$name" \
    "Creator: Tool: $tool" \
    "Created: $(date -u -d "@${SOURCE_DATE_EPOCH:-0}" +%Y-%m-%dT%H:%M:%SZ)" '' \
    'PackageName: meshsmooth' 'SPDXID: SPDXRef-meshsmooth' "PackageVersion: $version" \
    'PackageDownloadLocation: NOASSERTION' 'PackageLicenseDeclared: Apache-2.0' \
    'Relationship: SPDXRef-DOCUMENT DESCRIBES SPDXRef-meshsmooth'
  while read -r package how; do
    # shellcheck disable=SC2016  # dpkg-query's own variables
    IFS=' ' read -r package_version source source_version < <(dpkg-query -W \
      -f '${Version} ${source:Package} ${source:Version}\n' "$package")
    reference=SPDXRef-deb-${package//[^A-Za-z0-9.-]/-}
    printf '%s\n' '' "PackageName: $package" "SPDXID: $reference" \
      "PackageVersion: $package_version" 'PackageDownloadLocation: NOASSERTION' \
      "PackageSourceInfo: built from $source $source_version" \
      "ExternalRef: PACKAGE-MANAGER purl pkg:deb/debian/${package//+/%2B}@${package_version//+/%2B}?arch=amd64&distro=$distribution" \
      "Relationship: SPDXRef-meshsmooth $how $reference"
  done
}
