# Sourced by the scripts beside it: where the checkout is, how they speak and how
# they get their packages.
# The variables are for the scripts that source this.
# shellcheck shell=bash disable=SC2034
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
jobs=$(nproc)

say() { printf '\n==> %s\n' "$*"; }

die() {
  printf 'error: %s\n' "$*" >&2
  exit 1
}

# What compiles the programs. Versions are those of Debian 12; cmake/dependencies.cmake
# checks them.
build_packages=(
  g++ cmake ninja-build ccache
  libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
  libtbb-dev libspdlog-dev libcli11-dev
  libvtk9-dev libgmsh-dev libtet1.5-dev
)
# What the tests need beside that.
test_packages=(
  libgtest-dev libgmock-dev libeigen3-dev
  clang-format clang-tidy shellcheck python3
)
# What scripts/picture.py imports.
picture_packages=(python3-numpy python3-matplotlib python3-vtk9)

# What scripts/bundle needs beside the first.
bundle_packages=(libgtest-dev libgmock-dev libeigen3-dev libbenchmark-dev binutils zstd)

# install_packages NAME…: installs by apt what is missing, as root or through sudo.
install_packages() {
  local missing=() as_root=() name log=$root/build/apt.log
  for name in "$@"; do
    # shellcheck disable=SC2016  # dpkg-query's own variable
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$name" 2>/dev/null) == installed ]] ||
      missing+=("$name")
  done
  ((${#missing[@]})) || return 0

  if ((EUID != 0)); then
    command -v sudo >/dev/null ||
      die "missing packages; run as root: apt-get install --no-install-recommends ${missing[*]}"
    as_root=(sudo)
  fi
  say "Installing ${missing[*]} (log: ${log#"$root"/})"
  mkdir -p "$root/build"
  {
    "${as_root[@]}" apt-get update &&
      "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes \
        --no-install-recommends -o Dpkg::Use-Pty=0 "${missing[@]}"
  } >"$log" 2>&1 || {
    tail -n 20 "$log" >&2
    die "apt could not install the packages; its whole output is in $log"
  }
}
