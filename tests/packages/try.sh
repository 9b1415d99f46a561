#!/usr/bin/env bash
# Installs the packages on a clean Debian 12 and tries each there: tests/packages/try.sh PACKAGES EXAMPLES [ROOT]
# PACKAGES: a folder of .deb files. EXAMPLES: the folder examples. ROOT: where the clean system is made, by debootstrap; one that is there
# already is used. Needs to be root, and a mirror of Debian (MIRROR).
set -euo pipefail
packages=$(realpath "$1")
examples=$(realpath "$2")
made=
root=${3:-}
if [ "$(id -u)" -ne 0 ]; then
  echo "try: a clean root is made as root; run this as root" >&2
  exit 4
fi
if [ -z "$root" ]; then
  root=$(mktemp -d)
  made=1
fi
if [ ! -x "$root/usr/bin/apt-get" ]; then
  command -v debootstrap >/dev/null || { echo "try: debootstrap is not installed" >&2; exit 4; }
  debootstrap --variant=minbase bookworm "$root" "${MIRROR:-http://deb.debian.org/debian}" >"$root.log" 2>&1 || { tail -5 "$root.log" >&2; exit 4; }
fi
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp DEBIAN_FRONTEND=noninteractive LANG=C.UTF-8 "$@"; }
finish() {
  umount "$root/proc" 2>/dev/null || true
  if [ -n "$made" ]; then rm -rf "$root"; fi
}
trap finish EXIT
mount -t proc proc "$root/proc"
rm -rf "$root/try" && mkdir -p "$root/try"
cp "$packages"/*.deb "$root/try/"
cp "$examples/c/print_cut.c" "$root/try/"
# What a path of its own needs to reach a mirror comes from here, and goes when the packages are in.
cp /etc/resolv.conf "$root/etc/resolv.conf"

said() { printf '%-52s ' "$1"; }
passes() { said "$1"; shift; if out=$(inside "$@" 2>&1); then echo ok; else echo "FAILED"; echo "$out" | tail -20; exit 1; fi; }

inside apt-get update -q >/dev/null
for deb in "$root"/try/*.deb; do
  name=$(dpkg-deb -f "$deb" Package)
  passes "$name is not there before" sh -c "! dpkg -s $name"
done
# The shared library first: nothing but it and what it names may be needed.
passes "install the library alone" sh -c "apt-get install -y -q --no-install-recommends /try/liblodestone0_*.deb"
passes "it is found by the linker" sh -c "ldconfig -p | grep -q liblodestone.so.0"
passes "install the program" sh -c "apt-get install -y -q --no-install-recommends /try/lodestone_*.deb"
passes "lodestone --version" sh -c "lodestone --version | grep -E '^lodestone [0-9]+\.[0-9]+\.[0-9]+ \([0-9a-f]+'"
passes "generate, bake, verify, extract" sh -c "cd /try && lodestone generate rock --triangles 4000 -o rock.ply &&
  lodestone bake rock.ply -o rock.lode --backends lod,vgi --order static && lodestone verify rock.lode &&
  lodestone extract rock.lode --triangles 500 -o rock.glb && test -s rock.glb"
passes "its manual page and completion are there" sh -c "test -s /usr/share/bash-completion/completions/lodestone &&
  (test -s /usr/share/man/man1/lodestone.1 || test -s /usr/share/man/man1/lodestone.1.gz || grep -q 'path-exclude.*man' /etc/dpkg/dpkg.cfg.d/*)"
passes "without a driver it says what is missing" sh -c "cd /try && lodestone render rock.lode -o rock.png; test \$? -eq 4"
passes "install the driver that it recommends" apt-get install -y -q --no-install-recommends mesa-vulkan-drivers
passes "render" sh -c "cd /try && lodestone render rock.lode --backend vgi --size 320x240 -o rock.png && test -s rock.png"
passes "the program that reads .vdb is found" sh -c "cd /try && echo no grid at all, but some text that goes on > bad.vdb &&
  echo '{\"lodestone\": \"scene\", \"version\": 1, \"assets\": [{\"name\": \"rock\", \"file\": \"rock.lode\"}],
    \"instances\": [{\"asset\": \"rock\"}], \"volumes\": [{\"grid\": \"bad.vdb\"}]}' > bad.scene.json &&
  lodestone render bad.scene.json -o bad.png 2> bad.txt; test \$? -eq 3 && grep 'bad.vdb: OpenVDB' bad.txt"
passes "install the development package and a compiler" sh -c "apt-get install -y -q --no-install-recommends /try/liblodestone-dev_*.deb gcc libc6-dev pkg-config"
passes "compile and run the example in C" sh -c "cd /try && cc print_cut.c \$(pkg-config --cflags --libs lodestone) -lm -o print_cut && ./print_cut rock.lode"
if ls "$root"/try/python3-lodestone_*.deb >/dev/null 2>&1; then
  passes "install the Python module" sh -c "apt-get install -y -q --no-install-recommends /try/python3-lodestone_*.deb"
  passes "import, simplify, open, render" python3 -c "
import lodestone
mesh = lodestone.read('/try/rock.ply')
assert len(lodestone.simplify(mesh, triangles=500).triangles) <= 500
assert lodestone.open('/try/rock.lode').render(backend='vgi', width=64, height=48).shape == (48, 64, 4)"
fi
passes "remove all" sh -c "apt-get remove -y -q lodestone liblodestone0 && ! test -e /usr/bin/lodestone && ! test -e /usr/libexec/lodestone && ! ls /usr/lib/liblodestone*"
echo "all packages install, work and go away on a clean Debian 12"
