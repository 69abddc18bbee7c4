#!/usr/bin/env bash
# Installs the library, shared as built and static, and builds and runs tests/consumer against each through the
# CMake package and through pkg-config: install_test.sh SOURCE_FOLDER BUILD_FOLDER COMPILER
set -euo pipefail
source=$1 build=$2 compiler=$3
work=$(mktemp -d)
# Beside the folder of the shared build: the same relative paths, so that ccache has most of it already.
static_build=$(dirname "$build")/install_test_static
trap 'rm -rf "$work" "$static_build"' EXIT

check() { # check PREFIX PKG_CONFIG_FLAGS...
    local prefix=$1
    shift
    cmake -S "$source/tests/consumer" -B "$prefix/consumer" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" \
        -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$prefix" >"$work/log" || { cat "$work/log"; exit 1; }
    cmake --build "$prefix/consumer" -- --quiet
    "$prefix/consumer/consumer"

    local pc flags
    pc=$(find "$prefix" -name btfield.pc)
    flags=$(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config "$@" --cflags --libs btfield)
    # shellcheck disable=SC2086  # the flags are words
    "$compiler" -std=c++20 "$source/tests/consumer/consumer.cpp" $flags -o "$prefix/by_pkg_config"
    "$prefix/by_pkg_config"  # which finds the library where it was linked to it
}

echo "As built, moved after installing"
cmake --install "$build" --prefix "$work/installed" >/dev/null
mv "$work/installed" "$work/moved"
check "$work/moved"
"$work/moved/bin/btfield" --version
for text in man/man1/btfield.1 man/man1/btfield-experiment-run.1 bash-completion/completions/btfield \
    zsh/site-functions/_btfield fish/vendor_completions.d/btfield.fish; do
    [[ -s $work/moved/share/$text ]] || { echo "share/$text is not installed"; exit 1; }
done

for document in LICENSE README.md CHANGELOG.md CITATION.cff docs/library.md docs/command-line.md docs/models/3d-car.md \
    docs/experiment.schema.json examples/opencl_program.cpp; do
    [[ -s $work/moved/share/doc/btfield/$document ]] || { echo "$document is not installed"; exit 1; }
done
"$work/moved/bin/btfield" --help | grep share/doc/btfield >/dev/null || { echo "the command does not say where documents are"; exit 1; }

echo "Public names and no others"
for library in "$work"/moved/lib*/libbtfield.so "$work"/moved/lib*/*/libbtfield.so \
    "$work"/moved/lib*/libbtfield_experiment.so "$work"/moved/lib*/*/libbtfield_experiment.so; do
    [[ -f $library ]] || continue
    names=$(nm -DC --defined-only "$library" | cut -d' ' -f3-)
    grep -q '^btfield::' <<<"$names" || { echo "$library has no names"; exit 1; }
    # btfield_temporary_names is what library, experiments and command share of one process.
    if grep -v '^btfield::\|^\(vtable\|typeinfo\|typeinfo name\) for btfield::\|^btfield_temporary_names$' <<<"$names" ||
        grep 'btfield::detail\|::Impl' <<<"$names"; then
        echo "$library shows these"
        exit 1
    fi
done
ldd "$work"/moved/bin/btfield | grep libsqlite3 >/dev/null || { echo "the command does without SQLite?"; exit 1; }
if readelf -d "$work"/moved/lib*/libbtfield.so "$work"/moved/lib*/*/libbtfield.so 2>/dev/null | grep 'sqlite\|OpenImageIO\|libpng'; then
    echo "libbtfield needs what only its module or experiments may need"
    exit 1
fi

echo "A program with Eigen of its own, compiled for this processor"
pc=$(find "$work/moved" -name btfield.pc)
# shellcheck disable=SC2046  # the flags are words
"$compiler" -std=c++20 -O2 -march=native "$source/tests/consumer/own_eigen.cpp" \
    $(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --cflags --libs btfield) $(pkg-config --cflags eigen3) -o "$work/own_eigen"
libdir=$(dirname "$(dirname "$pc")")
LD_LIBRARY_PATH=$libdir "$work/own_eigen"
# Where both hold a function, the loader must not have led the library to the program's.
LD_BIND_NOW=1 LD_DEBUG=bindings LD_DEBUG_OUTPUT="$work/bindings" LD_LIBRARY_PATH=$libdir "$work/own_eigen" >/dev/null
cat "$work"/bindings.* >"$work/bindings"
grep -q "libbtfield[^ ]* \[0\] to .*libOpenCL" "$work/bindings" || { echo "the loader told nothing"; exit 1; }
if grep "libbtfield[^ ]* \[0\] to $work/own_eigen \[0\]: normal symbol \`_ZNK\?5Eigen" "$work/bindings"; then
    echo "the library calls the program's Eigen"
    exit 1
fi

echo "Static"
cmake -S "$source" -B "$static_build" -G Ninja -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE=Release \
    -DBUILD_SHARED_LIBS=OFF -DBTFIELD_BUILD_TESTS=OFF -DBTFIELD_BUILD_EXAMPLES=OFF >"$work/log" ||
    { cat "$work/log"; exit 1; }
cmake --build "$static_build" -- --quiet
cmake --install "$static_build" --prefix "$work/static" >/dev/null
check "$work/static" --static
