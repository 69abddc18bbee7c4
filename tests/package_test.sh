#!/usr/bin/env bash
# Installs the Debian packages and uses them as a user would: package_test.sh FOLDER_OF_PACKAGES
# In a new Debian of this one's release where one can be made (root, debootstrap, a mirror), else unpacked into a folder;
# the last line says which.
set -euo pipefail
packages=$(readlink -f "$1")
source=$(readlink -f "$(dirname "${BASH_SOURCE[0]}")/..")
work=$(mktemp -d)
clean() {
    for mounted in "$work"/root/{proc,sys}; do
        ! mountpoint -q "$mounted" || umount -l "$mounted"
    done
    rm -rf --one-file-system "$work"
}
trap clean EXIT

# Works in a folder that holds cork.png and consumer/.
use_command() {
    set -euo pipefail
    btfield --version
    btfield devices
    btfield devices --json | grep -q '"name"' || { echo "no OpenCL device"; exit 1; }
    btfield fit cork.png -o cork.json --crop 0,0,128,128
    btfield synth cork.json -o more.png --size 300x200
    btfield compare cork.png more.png
    echo '{"pictures": [{"material": "cork", "files": ["more.png"]}], "models": ["2d-car"],
        "orders": [1], "levels": [1], "seeds": [1]}' >small.json
    btfield experiment run small.json --out small.db
}
use_library() {
    set -euo pipefail
    cmake -S consumer -B built -DCMAKE_BUILD_TYPE=Release >log || { cat log; exit 1; }
    cmake --build built
    built/consumer
    # shellcheck disable=SC2046  # the flags are words
    g++ -std=c++20 consumer/consumer.cpp $(pkg-config --cflags --libs btfield) -o by_pkg_config
    ./by_pkg_config
}

# Makes a Debian in $work/root, where one can be made; what stands in the way goes to $reason.
reason='' release=''
make_root() {
    local mirror
    ((EUID == 0)) || { reason="not root"; return 1; }
    command -v debootstrap >/dev/null || { reason="no debootstrap"; return 1; }
    # shellcheck source=/dev/null
    release=$(. /etc/os-release && echo "$VERSION_CODENAME")
    # shellcheck disable=SC2016  # apt's variables
    mirror=$(apt-get indextargets --format '$(REPO_URI) $(CODENAME) $(COMPONENT)' 'Created-By: Packages' |
        awk -v release="$release" '$2 == release && $3 == "main" { print $1; exit }')
    [[ -n $mirror ]] || { reason="apt knows no mirror of $release"; return 1; }
    if ! debootstrap --variant=minbase "$release" "$work/root" "$mirror" >"$work/log" 2>&1; then
        tail -5 "$work/log"
        reason="debootstrap failed"
        return 1
    fi
    mount -t proc proc "$work/root/proc" 2>/dev/null || echo "(no /proc in the new Debian)"
    mount -t sysfs -o ro sys "$work/root/sys" 2>/dev/null || echo "(no /sys in the new Debian)"
}

# run FUNCTION COMMAND...: the command ends in a shell that runs the function; shows what that said when it fails.
run() {
    local start=$SECONDS
    echo "$1"
    "${@:2}" -c "$(declare -f "$1"); $1" </dev/null >"$work/log" 2>&1 || { cat "$work/log"; echo "$1 failed"; exit 1; }
    echo "  $((SECONDS - start)) s"
}

install_packages() {
    set -euo pipefail
    apt-get update -q
    # Only what the packages need, and the driver that they recommend: all recommendations are ten times as much.
    apt-get install -q -y --no-install-recommends pocl-opencl-icd \
        ./packages/btfield_*.deb ./packages/libbtfield0_*.deb ./packages/libbtfield-experiment0_*.deb
}
install_development() {
    set -euo pipefail
    apt-get install -q -y --no-install-recommends ./packages/libbtfield-dev_*.deb g++ cmake make pkg-config
}
look_around() {
    set -euo pipefail
    if ldd /usr/bin/btfield | grep "not found"; then exit 1; fi
    test -s /usr/share/man/man1/btfield-fit.1.gz || grep -q "path-exclude=/usr/share/man" -r /etc/dpkg/dpkg.cfg.d
    bash -c 'source /usr/share/bash-completion/completions/btfield && complete -p btfield'
    test -s /usr/share/zsh/vendor-completions/_btfield
    test -s /usr/share/fish/vendor_completions.d/btfield.fish
}
remove_packages() {
    set -euo pipefail
    apt-get purge -q -y btfield 'libbtfield*' >/dev/null
    if find / -xdev \( -path /home -o -path /root \) -prune -o -name '*btfield*' -print | grep .; then exit 1; fi
}

if make_root; then
    mkdir "$work/root/home/packages"
    cp "$packages"/*.deb "$work/root/home/packages"
    cp -r "$source/tests/consumer" "$source/tests/data/cork.png" "$work/root/home"
    for step in install_packages look_around use_command install_development use_library remove_packages; do
        run "$step" chroot "$work/root" /usr/bin/env -i -C /home \
            HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive /bin/bash
    done
    echo "Packages installed, used and removed in a new Debian $release"
else
    mkdir "$work/unpacked" "$work/home"
    for package in "$packages"/*.deb; do dpkg-deb -x "$package" "$work/unpacked"; done
    cp -r "$source/tests/consumer" "$source/tests/data/cork.png" "$work/home"
    libraries=$(dirname "$(find "$work/unpacked" -name 'libbtfield.so')")
    export PATH=$work/unpacked/usr/bin:$PATH LD_LIBRARY_PATH=$libraries CMAKE_PREFIX_PATH=$work/unpacked/usr \
        PKG_CONFIG_PATH=$libraries/pkgconfig
    for step in use_command use_library; do run "$step" env -C "$work/home" bash; done
    echo "Packages unpacked into a folder and used from there; not installed: $reason"
fi
