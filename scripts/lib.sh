# shellcheck shell=bash
# What setup.sh, demo.sh and test.sh share. Source it: it defines functions and
# changes nothing by itself. Bash 3.2 (macOS) is enough.

MARMOR_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf 'marmor: %s\n' "$*"; }
complain() { printf 'marmor: %s\n' "$*" >&2; }
have() { command -v "$1" >/dev/null 2>&1; }

# ---------------------------------------------------------------- what is here

# One word per thing that can be missing; package_for names its package.
present() {
    case $1 in
        compiler) have cc && { have c++ || [ -n "${CXX:-}" ]; } ;;
        cmake | git | ninja | python3) have "$1" ;;
        vulkan-loader) have_vulkan_loader ;;
        vulkan-driver) have_vulkan_file icd.d '*.json' "${VK_DRIVER_FILES:-}${VK_ADD_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}" ;;
        validation-layer) have_vulkan_file explicit_layer.d 'VkLayer_khronos_validation.json' "${VK_LAYER_PATH:-}${VK_ADD_LAYER_PATH:-}" ;;
        spirv-tools) have spirv-val ;;
        xvfb) have Xvfb ;;
        xdotool) have xdotool ;;
        imagemagick) have import ;;
        window-libraries) have_window_libraries ;;
        jemalloc) [ -n "$(jemalloc_file)" ] ;;
    esac
}

# The libraries that the system finds by name; none where it keeps no list.
libraries() {
    PATH="$PATH:/sbin:/usr/sbin" ldconfig -p 2>/dev/null || true
}

have_vulkan_loader() {
    local dir cache
    cache=$(libraries)
    case $cache in *libvulkan.so.1*) return 0 ;; esac
    local IFS=:
    for dir in ${LD_LIBRARY_PATH:-} ${DYLD_LIBRARY_PATH:-} ${VULKAN_SDK:+"$VULKAN_SDK/lib"} \
        /usr/lib /usr/lib64 /usr/lib/*-linux-gnu /usr/local/lib /opt/homebrew/lib; do
        if [ -e "$dir/libvulkan.so.1" ] || [ -e "$dir/libvulkan.1.dylib" ]; then return 0; fi
    done
    return 1
}

# What a window on X11 is opened with, and asked for only then.
have_window_libraries() {
    local cache library
    cache=$(libraries)
    for library in libX11.so.6 libX11-xcb.so.1 libXcursor.so.1 libXi.so.6 libxkbcommon-x11.so.0; do
        case $cache in *"$library "*) ;; *) return 1 ;; esac
    done
}

# The allocator that scripts/view_soak.sh measures memory with; nothing where there is none.
jemalloc_file() {
    libraries | sed -n 's/.*libjemalloc\.so\.2 .*=> //p' | head -n 1
}

# have_vulkan_file FOLDER PATTERN OVERRIDE: is there such a manifest where the
# Vulkan loader looks, or does the environment point elsewhere?
have_vulkan_file() {
    local dir file
    [ -z "$3" ] || return 0
    local IFS=:
    for dir in ${XDG_CONFIG_HOME:-${HOME:-}/.config} /etc/xdg ${XDG_CONFIG_DIRS:-} \
        ${XDG_DATA_HOME:-${HOME:-}/.local/share} ${XDG_DATA_DIRS:-} ${VULKAN_SDK:+"$VULKAN_SDK/share"} \
        /usr/local/etc /etc /usr/local/share /usr/share \
        /run/opengl-driver/share /opt/homebrew/etc /opt/homebrew/share; do
        # shellcheck disable=SC2231 # the pattern is meant to expand
        for file in "$dir"/vulkan/$1/$2; do
            [ ! -e "$file" ] || return 0
        done
    done
    return 1
}

# ------------------------------------------------------------------- packages

# The word a system's packages are listed under.
system() {
    local ids=''
    if [ "$(uname -s)" = Darwin ]; then
        echo macos
        return
    fi
    # shellcheck disable=SC1091
    [ ! -r /etc/os-release ] || ids=$(. /etc/os-release && echo " ${ID:-} ${ID_LIKE:-} ")
    case $ids in
        *' debian '* | *' ubuntu '*) echo debian ;;
        *' fedora '* | *' rhel '*) echo fedora ;;
        *' arch '*) echo arch ;;
        *suse*) echo suse ;;
        *' nixos '*) echo nixos ;;
        *) echo other ;;
    esac
}

package_for() {
    case $1:$2 in
        debian:compiler) echo g++ ;;
        debian:ninja) echo ninja-build ;;
        debian:vulkan-loader) echo libvulkan1 ;;
        debian:vulkan-driver) echo mesa-vulkan-drivers ;;
        debian:validation-layer) echo vulkan-validationlayers ;;
        debian:jemalloc | suse:jemalloc) echo libjemalloc2 ;;
        debian:window-libraries) echo libx11-6 libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 ;;

        fedora:compiler) echo gcc-c++ ;;
        fedora:ninja) echo ninja-build ;;
        fedora:vulkan-driver) echo mesa-vulkan-drivers ;;
        fedora:validation-layer) echo vulkan-validation-layers ;;
        fedora:xvfb) echo xorg-x11-server-Xvfb ;;
        fedora:imagemagick) echo ImageMagick ;;
        fedora:window-libraries) echo libX11 libX11-xcb libXcursor libXi libxkbcommon-x11 ;;

        arch:compiler) echo gcc ;;
        arch:python3) echo python ;;
        arch:vulkan-loader) echo vulkan-icd-loader ;;
        arch:vulkan-driver) echo vulkan-swrast ;;
        arch:validation-layer) echo vulkan-validation-layers ;;
        arch:xvfb) echo xorg-server-xvfb ;;
        arch:window-libraries) echo libx11 libxcursor libxi libxkbcommon-x11 ;;

        suse:compiler) echo gcc-c++ ;;
        suse:vulkan-loader) echo libvulkan1 ;;
        suse:vulkan-driver) echo libvulkan_lvp ;;
        suse:validation-layer) echo vulkan-validationlayers ;;
        suse:xvfb) echo xorg-x11-server-Xvfb ;;
        suse:imagemagick) echo ImageMagick ;;
        suse:window-libraries) echo libX11-6 libX11-xcb1 libXcursor1 libXi6 libxkbcommon-x11-0 ;;

        nixos:compiler) echo gcc ;;
        nixos:vulkan-driver) echo mesa ;;
        nixos:validation-layer) echo vulkan-validation-layers ;;
        nixos:xvfb) echo xorg.xorgserver ;;
        nixos:window-libraries) echo xorg.libX11 xorg.libXcursor xorg.libXi libxkbcommon ;;

        macos:vulkan-driver) echo molten-vk ;;
        macos:validation-layer) echo vulkan-validationlayers ;;
        *) echo "$2" ;;
    esac
}

# install MISSING...: apt where there is apt; anywhere else, say what to install.
install() {
    local family packages='' thing
    family=$(system)
    for thing in "$@"; do packages="$packages $(package_for "$family" "$thing")"; done
    packages=${packages# }
    case $family in
        debian)
            apt_install "$packages"
            return
            ;;
        fedora) thing="sudo dnf install $packages" ;;
        arch) thing="sudo pacman -S --needed $packages" ;;
        suse) thing="sudo zypper install $packages" ;;
        nixos) thing="nix-shell -p $packages   (a driver: hardware.graphics.enable = true)" ;;
        macos)
            # The compiler comes from Apple, and is asked for first.
            case $packages in
                compiler) thing='xcode-select --install' ;;
                'compiler '*) thing="xcode-select --install; brew install ${packages#compiler }" ;;
                *) thing="brew install $packages" ;;
            esac
            ;;
        *) thing='(by whatever name your system has for them)' ;;
    esac
    complain "missing: $*"
    complain "install: $thing"
    return 2
}

# shellcheck disable=SC2086 # the list is meant to split
apt_install() {
    local packages=$1 root='' attempt log
    if [ "$(id -u)" -ne 0 ]; then
        if ! have sudo; then
            complain "missing: $packages. As root, run:"
            complain "  apt-get update && apt-get install -y --no-install-recommends $packages"
            return 2
        fi
        root=sudo
    fi
    log=$(mktemp)
    say "installing with apt: $packages"
    for attempt in 1 2; do
        # An update that fails halfway (one dead mirror) may still be enough.
        $root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 -q update >"$log" 2>&1 || true
        if $root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 -q install -y \
            --no-install-recommends $packages >>"$log" 2>&1 </dev/null; then
            rm -f "$log"
            return 0
        fi
        [ "$attempt" -eq 2 ] || { say 'apt failed; trying once more in 5 s' && sleep 5; }
    done
    cat "$log" >&2
    rm -f "$log"
    complain "apt could not install: $packages (its output is above). To do it by hand, as root:"
    complain "  apt-get update && apt-get install -y --no-install-recommends $packages"
    return 2
}

# ----------------------------------------------------------------------- Rust

check_rust() {
    local wanted found
    if ! have cargo && [ -x "${CARGO_HOME:-${HOME:-}/.cargo}/bin/cargo" ]; then
        PATH="${CARGO_HOME:-${HOME:-}/.cargo}/bin:$PATH"
        export PATH
    fi
    wanted=$(sed -n 's/^rust-version *= *"\([0-9.]*\)".*/\1/p' "$MARMOR_ROOT/Cargo.toml")
    if ! have cargo || ! have rustc; then
        complain "Rust is missing: install $wanted or later from https://rustup.rs"
        return 2
    fi
    if ! found=$(rustc --version) || ! cargo --version >/dev/null; then
        complain "rustc or cargo does not run (its message is above): see https://rustup.rs"
        return 2
    fi
    found=${found#rustc }
    found=${found%%[ -]*}
    if ! at_least "$found" "$wanted"; then
        complain "Rust $found is too old, $wanted or later is needed: rustup update stable, or https://rustup.rs"
        return 2
    fi
}

# at_least 1.90.0 1.88: by major, then by minor version.
at_least() {
    local major=${1%%.*} minor=${1#*.} want_major=${2%%.*} want_minor=${2#*.}
    minor=${minor%%.*} want_minor=${want_minor%%.*}
    [ "$major" -gt "$want_major" ] || { [ "$major" -eq "$want_major" ] && [ "$minor" -ge "$want_minor" ]; }
}

check_rust_tools() {
    if cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1; then return 0; fi
    if have rustup && rustup component add rustfmt clippy; then return 0; fi
    complain 'rustfmt or clippy is missing: rustup component add rustfmt clippy'
    return 2
}

# -------------------------------------------------------------------- shaderc

# The folder in which shaderc-sys 0.10 would take the system's library, by the
# rules of its build script; fails where that script would panic or find none.
shaderc_folder() {
    local flags dir
    if [ -n "${SHADERC_LIB_DIR+set}" ]; then
        case $SHADERC_LIB_DIR in /*) dir=$SHADERC_LIB_DIR ;; *) return 1 ;; esac
    elif [ -n "${VULKAN_SDK+set}" ]; then
        [ -r "$VULKAN_SDK/share/vulkan/registry/vk.xml" ] || return 1
        dir=$VULKAN_SDK/lib
    elif flags=$(PKG_CONFIG_ALLOW_SYSTEM_LIBS=1 "${PKG_CONFIG:-pkg-config}" --libs shaderc 2>/dev/null); then
        case " $flags" in *' -L'*) ;; *) return 1 ;; esac
        dir=" $flags"
        dir=${dir#* -L}
        dir=${dir%% *}
    elif [ "$(uname -s)" = Darwin ]; then
        dir=/usr/local/lib
    else
        dir=$(uname -m)
        case $dir in i?86) dir=i386 ;; esac
        dir=/usr/lib/$dir-linux-gnu
        if [ ! -d "$dir" ]; then
            if [ "$(uname -m)" = x86_64 ] && [ -d /usr/lib64 ]; then dir=/usr/lib64; else dir=/usr/lib; fi
        fi
    fi
    [ -d "$dir" ] && (cd "$dir" && pwd -P)
}

# Sets MARMOR_CARGO_FEATURES: link the system's libshaderc where a program that
# uses it links and runs, build it from source everywhere else. The probe is
# linked by rustc, because rustc's linker and flags are what must succeed.
choose_shaderc() {
    local dir library='' suffix=so work why='no system library found'
    if [ -n "${MARMOR_CARGO_FEATURES+set}" ]; then
        export MARMOR_CARGO_FEATURES
        return 0
    fi
    export MARMOR_CARGO_FEATURES=''
    [ "$(uname -s)" != Darwin ] || suffix=dylib
    if dir=$(shaderc_folder); then
        # The order is shaderc-sys's own: shared before static.
        if [ -e "$dir/libshaderc.$suffix" ]; then
            library=libshaderc.$suffix
            set -- dylib=shaderc
        elif [ -e "$dir/libshaderc_shared.$suffix" ]; then
            library=libshaderc_shared.$suffix
            set -- dylib=shaderc_shared
        elif [ -e "$dir/libshaderc_combined.a" ]; then
            library=libshaderc_combined.a
            set -- static=shaderc_combined
        fi
    fi
    if [ -n "$library" ]; then
        work=$(mktemp -d)
        local cplusplus=stdc++
        [ "$suffix" = so ] || cplusplus=c++
        if ! rustc --edition 2024 "$MARMOR_ROOT/scripts/shaderc_probe.rs" -o "$work/probe" \
            -L "native=$dir" -l "$1" -l "dylib=$cplusplus" >"$work/log" 2>&1; then
            why="$dir/$library does not link"
        elif ! "$work/probe" >"$work/log" 2>&1; then
            why="$dir/$library links but does not compile a shader"
        else
            MARMOR_CARGO_FEATURES=--no-default-features
        fi
        rm -rf "$work"
    fi
    if [ -n "$MARMOR_CARGO_FEATURES" ]; then
        say "shaderc: the system's, $dir/$library"
    else
        say "shaderc: built from its bundled sources ($why)"
    fi
}

# ----------------------------------------------------------------------- setup

# marmor_setup [--test]: installs or names what is missing, exports
# CARGO_TARGET_DIR and MARMOR_CARGO_FEATURES. Returns 2 if something is missing.
marmor_setup() {
    local tests='' wanted missing='' thing
    case ${1:-} in
        '') ;;
        --test)
            tests='validation-layer spirv-tools'
            # Windows are tested on X11 alone.
            [ "$(uname -s)" != Linux ] || tests="$tests xvfb xdotool imagemagick window-libraries jemalloc"
            ;;
        *)
            complain "unknown argument '$1' (known: --test)"
            return 2
            ;;
    esac
    export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/marmor/target}"
    check_rust || return
    [ -z "$tests" ] || check_rust_tools || return

    wanted="compiler python3 vulkan-loader vulkan-driver $tests"
    ! present compiler || choose_shaderc
    # shaderc-sys asks for git as well, though its sources are bundled.
    [ -n "${MARMOR_CARGO_FEATURES:-}" ] || wanted="$wanted cmake ninja git"
    for thing in $wanted; do present "$thing" || missing="$missing $thing"; done
    if [ -n "$missing" ]; then
        # shellcheck disable=SC2086 # the list is meant to split
        install $missing || return
        for thing in $missing; do
            present "$thing" || {
                complain "still missing after the installation: $thing"
                return 2
            }
        done
    fi
    choose_shaderc
}

# ------------------------------------------------------------------- building

shaderc_is_built() {
    local library
    for library in "$CARGO_TARGET_DIR"/release/build/shaderc-sys-*/out/lib/libshaderc_combined.a; do
        [ ! -e "$library" ] || return 0
    done
    return 1
}

# One line on what the build is at.
build_state() {
    local ninja newest='' done_count total file command crates=''
    for ninja in "$CARGO_TARGET_DIR"/release/build/shaderc-sys-*/out/build/build.ninja; do
        if [ -e "$ninja" ] && { [ -z "$newest" ] || [ "$ninja" -nt "$newest" ]; }; then newest=$ninja; fi
    done
    if [ -n "$newest" ] && [ -z "$MARMOR_CARGO_FEATURES" ] &&
        [ ! -e "${newest%/build/build.ninja}/lib/libshaderc_combined.a" ]; then
        done_count=$(find "${newest%/build.ninja}" -name '*.o' 2>/dev/null | wc -l)
        total=$(grep -cE '^build [^:]*\.o:' "$newest" || true)
        [ "$total" -gt 0 ] || total=376
        printf 'shaderc: %d of %d objects, ~%d %%' "$done_count" "$total" $((100 * done_count / total))
        return
    fi
    for file in /proc/[0-9]*/cmdline; do
        command=$(tr '\0' ' ' 2>/dev/null <"$file") || continue
        case $command in
            *' --crate-name '*"$CARGO_TARGET_DIR"*)
                command=${command#* --crate-name }
                command=${command%% *}
                # clippy and rustc show the same crate twice.
                case $crates in *" $command"*) ;; *) crates="$crates $command" ;; esac
                ;;
        esac
    done
    printf 'compiling:%s' "${crates:- Rust crates}"
}

# Prints a line every 30 s until killed, or until the script that started it ends.
watch_build() {
    local seconds=0 nap=''
    trap '[ -z "$nap" ] || kill "$nap" 2>/dev/null; exit 0' TERM
    while true; do
        # The nap must not hold the script's output open once the script is gone.
        sleep 30 >/dev/null 2>&1 &
        nap=$!
        wait "$nap"
        kill -0 "$$" 2>/dev/null || exit 0
        seconds=$((seconds + 30))
        printf 'marmor: %2d min %02d s  %s\n' $((seconds / 60)) $((seconds % 60)) "$(build_state)"
    done
}

# watched COMMAND...: runs a cargo command that may have shaderc to build first.
# The command's own output and exit status pass through untouched.
watched() {
    local status=0
    if [ -z "$MARMOR_CARGO_FEATURES" ] && ! shaderc_is_built; then
        say "Building shaderc from source: 8-15 minutes on 2 cores, once; later builds reuse $CARGO_TARGET_DIR"
    fi
    watch_build &
    MARMOR_WATCHER=$!
    trap 'kill "$MARMOR_WATCHER" 2>/dev/null || true' EXIT
    "$@" || status=$?
    kill "$MARMOR_WATCHER" 2>/dev/null || true
    wait "$MARMOR_WATCHER" 2>/dev/null || true
    trap - EXIT
    return "$status"
}

# build_marmor: the program, from the same parts as the tests: alone it has other features of its crates, and a build of each.
build_marmor() {
    watched cargo build --release --workspace --bin marmor ${MARMOR_CARGO_FEATURES:+"$MARMOR_CARGO_FEATURES"}
}
