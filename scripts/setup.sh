#!/bin/sh
# Installs what the build and the tests need and this system lacks; changes nothing and says nothing when all is there.
#
#   scripts/setup.sh [runtime|test|build-shaders|deny]
#
# runtime (default)  C and C++ compiler, Vulkan loader, a Vulkan driver (Mesa's CPU driver where there is none at all)
#                    and the validation layers
# test               runtime, and Chromium, in which the tests of the HTML page run
# build-shaders      runtime, plus what compiling the shaders takes (make spv, make check-spv): cmake, ninja, git,
#                    python3, and spirv-val to validate the result
# deny               cargo-deny alone, built from source (make deny); this takes minutes
set -eu

mode=${1:-runtime}
case $mode in
runtime | test | build-shaders | deny) ;;
*)
    echo "scripts/setup.sh: unknown mode '$mode'; use runtime, test, build-shaders or deny" >&2
    exit 2
    ;;
esac

# ldconfig lies in sbin, which is not on every user's path; rustup installs into the home directory.
PATH=$PATH:/usr/sbin:/sbin:${HOME:-/}/.cargo/bin

has() { command -v "$1" >/dev/null 2>&1; }

has_any() {
    for program; do
        if has "$program"; then return 0; fi
    done
    return 1
}

# Every folder where the Vulkan loader looks for .../vulkan/<kind>, a line each.
vulkan_folders() {
    {
        echo "${XDG_CONFIG_HOME:-${HOME:-/}/.config}"
        echo "${XDG_CONFIG_DIRS:-/etc/xdg}" | tr ':' '\n'
        printf '%s\n' /etc /usr/local/etc "${XDG_DATA_HOME:-${HOME:-/}/.local/share}"
        echo "${XDG_DATA_DIRS:-/usr/local/share:/usr/share}" | tr ':' '\n'
        printf '%s\n' /usr/local/share /usr/share /opt/homebrew/share /opt/homebrew/etc /run/opengl-driver/share
        if [ -n "${VULKAN_SDK:-}" ]; then printf '%s\n' "$VULKAN_SDK/share" "$VULKAN_SDK/etc"; fi
    } | sed "s|\$|/vulkan/$1|"
}

has_loader() {
    if has ldconfig && ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'; then return 0; fi
    for folder in $(echo "${LD_LIBRARY_PATH:-}:${DYLD_LIBRARY_PATH:-}:${DYLD_FALLBACK_LIBRARY_PATH:-}" | tr ':' ' ') \
        "${VULKAN_SDK:+$VULKAN_SDK/lib}" /opt/homebrew/lib /usr/local/lib /run/current-system/sw/lib; do
        if [ -e "$folder/libvulkan.so.1" ] || [ -e "$folder/libvulkan.1.dylib" ]; then return 0; fi
    done
    return 1
}

has_driver() {
    if [ -n "${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}${VK_ADD_DRIVER_FILES:-}" ]; then return 0; fi
    vulkan_folders icd.d | while read -r folder; do
        for manifest in "$folder"/*.json; do
            if [ -e "$manifest" ]; then echo found; fi
        done
    done | grep -q found
}

has_validation() {
    {
        echo "${VK_LAYER_PATH:-}:${VK_ADD_LAYER_PATH:-}" | tr ':' '\n'
        vulkan_folders explicit_layer.d
    } | while read -r folder; do
        if [ -e "$folder/VkLayer_khronos_validation.json" ]; then echo found; fi
    done | grep -q found
}

# Ubuntu's packages are a snap, or a script that installs one; a snap cannot read the files of the tests.
has_browser() {
    for program in chromium chromium-browser google-chrome google-chrome-stable; do
        path=$(command -v "$program") || continue
        case $(readlink -f "$path") in /snap/* | */bin/snap) continue ;; esac
        if [ "$(head -c 2 "$path")" = '#!' ] && grep -q '/snap/bin' "$path"; then continue; fi
        return 0
    done
    return 1
}

if ! has cargo; then
    echo "No Rust toolchain: install one from https://rustup.rs, then run this again." >&2
    exit 1
fi

if [ "$mode" = deny ]; then
    if ! has cargo-deny; then cargo install cargo-deny --locked; fi
    exit 0
fi

packages=
missing=
need() { # <Debian package> <what it is, for other systems>
    packages="$packages $1"
    missing="$missing
  - $2"
}

if ! has cc || ! has_any c++ g++ clang++; then need g++ "a C and C++ compiler (cc and c++)"; fi
has_loader || need libvulkan1 "the Vulkan loader (libvulkan)"
has_driver || need mesa-vulkan-drivers "a Vulkan 1.3 driver (Mesa's lavapipe runs on any CPU)"
has_validation || need vulkan-validationlayers "the Vulkan validation layers"
if [ "$mode" = test ] && ! has_browser; then
    # The only package that other systems are sure to have under this name is Debian's.
    if has apt-get && ! grep -q '^ID=ubuntu' /etc/os-release 2>/dev/null; then
        need chromium "Chromium"
    else
        echo "No Chromium or Chrome outside a snap: the tests of the HTML page are skipped, and .ci/run fails. Install" \
            "Google Chrome's package to run them." >&2
    fi
fi
if [ "$mode" = build-shaders ]; then
    has cmake || need cmake "cmake"
    has_any ninja ninja-build || need ninja-build "ninja"
    has git || need git "git"
    has_any python3 python || need python3 "Python 3"
    has spirv-val || need spirv-tools "SPIRV-Tools (spirv-val)"
fi

if [ -z "$packages" ]; then exit 0; fi

if ! has apt-get; then
    cat >&2 <<END
This system lacks:$missing
Install them with the system's package manager, then run this again:
  Fedora  dnf install gcc-c++ vulkan-loader mesa-vulkan-drivers vulkan-validation-layers
  Arch    pacman -S base-devel vulkan-icd-loader vulkan-swrast vulkan-validation-layers
  macOS   xcode-select --install; brew install vulkan-loader molten-vk vulkan-validationlayers
and, only to compile shaders:
  Fedora  dnf install cmake ninja-build git python3 spirv-tools
  Arch    pacman -S cmake ninja git python spirv-tools
  macOS   brew install cmake ninja git python3 spirv-tools
END
    exit 1
fi

run=
if [ "$(id -u)" != 0 ]; then
    if ! has sudo; then
        echo "This system lacks:$missing" >&2
        echo "Run as root: apt-get update && apt-get install --no-install-recommends$packages" >&2
        exit 1
    fi
    run=sudo
fi

echo "Installing:$packages"
$run env DEBIAN_FRONTEND=noninteractive apt-get update -q
# shellcheck disable=SC2086 # the list is meant to be split
$run env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $packages
