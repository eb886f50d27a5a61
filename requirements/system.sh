#!/bin/sh
# Installs the Debian/Ubuntu packages that tlsplan needs and that are missing; prints the command where it may not.
# Usage: requirements/system.sh [--tests | --firefox | --kernel-check]
#   --tests         what the browser tests need, too
#   --firefox       what tests of the viewer in Firefox need, too; without, they are skipped
#   --kernel-check  the checker of `make kernel-check`, too
set -eu

# PoCL links every kernel it compiles with the system's linker against libgcc and libc (gcc brings the first two).
# Open3D loads libusb, libGL and libgomp; PyVista renders through EGL with Mesa's software driver where there is no GPU.
wanted="gcc libc6-dev libusb-1.0-0 libgl1 libgomp1 libegl1 libgl1-mesa-dri libxrender1"
[ "${1:-}" = --tests ] && wanted="$wanted chromium"
[ "${1:-}" = --firefox ] && wanted="$wanted firefox-esr xvfb"
[ "${1:-}" = --kernel-check ] && wanted="$wanted oclgrind"
# The interpreter brings ensurepip unless it is Debian's own, which splits it off.
"${PYTHON:-python3}" -c 'import ensurepip, venv' 2>/dev/null || wanted="$wanted python3-venv"

if ! command -v dpkg-query >/dev/null 2>&1; then
    echo "tlsplan set-up: this is not Debian or Ubuntu; install what corresponds to: $wanted" >&2
    exit 0
fi

missing=""
for package in $wanted; do
    state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$state" = installed ] && continue
    # The browser tests look for these; Ubuntu has Chromium as a snap only, which can't be installed like this.
    if [ "$package" = chromium ]; then
        for browser in /usr/bin/chromium /usr/bin/chromium-browser /usr/bin/google-chrome /snap/bin/chromium; do
            [ -x "$browser" ] && continue 2
        done
    fi
    missing="$missing $package"
done
[ -z "$missing" ] && exit 0

if [ "$(id -u)" = 0 ]; then
    as_root=""
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null || { [ -t 0 ] && command -v sudo >/dev/null 2>&1; }; then
    as_root="sudo"
else
    echo "tlsplan set-up: these system packages are missing:$missing" >&2
    echo "Have an administrator run:  apt-get update && apt-get install -y --no-install-recommends$missing" >&2
    echo "then run the same make command again." >&2
    exit 1
fi
echo "tlsplan set-up: installing$missing"
$as_root apt-get update -q
if [ "${missing#*chromium}" != "$missing" ] && ! apt-cache show chromium >/dev/null 2>&1; then
    echo "tlsplan set-up: this system has no package 'chromium'; install Chromium or Google Chrome for the browser tests" >&2
    exit 1
fi
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing
