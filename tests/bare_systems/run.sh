#!/usr/bin/env bash
# Runs make targets from a fresh clone on bare Debian systems, as a new user has them: python3, make, git, nodejs, npm.
# Usage: tests/bare_systems/run.sh [--keep] [--targets "demo test-wheel test"] [suite ...]     suites: bookworm trixie
#   --keep      leave the systems' folders, and say where
#   --targets   what to make there, one after the other
# Needs root, debootstrap, and a network set up for apt, pip and npm, which is handed on. What is committed is tested.
# MIRROR=... names another Debian mirror than the host's; TMPDIR=... another place (8 GB a system); PYTEST_ARGS are passed on.
set -euo pipefail

repository=$(cd "$(dirname "$0")/../.." && pwd)
# Handed on where set: how this machine reaches the package indexes, and what make takes.
passed='^(PIP_|npm_config_|NPM_CONFIG_|UV_|NODE_EXTRA_CA_CERTS=|SSL_CERT_|REQUESTS_CA_BUNDLE=|OPENBLAS_|PYTEST_ARGS=|CI=|(http|https|no|HTTP|HTTPS|NO)_(proxy|PROXY)=)'

# In a mount namespace of its own: what is mounted below `system` is seen by nobody else and ends with it, so that
# removing the folder can never reach through a mount.
inside() {
    local suite=$1 system=$2 targets=$3 target began failed=0
    local packages="python3 make git nodejs npm"
    unset TMPDIR # a folder of the host
    mount -t proc proc /proc

    debootstrap --variant=minbase --include=ca-certificates "$suite" "$system" ${MIRROR:+"$MIRROR"} >"$system.log" 2>&1 ||
        { tail -n 20 "$system.log" >&2; return 1; }
    mountpoint -q "$system/proc" || mount -t proc proc "$system/proc"
    mount --rbind /dev "$system/dev"
    mount -t tmpfs tmpfs "$system/dev/shm"
    mount --rbind /sys "$system/sys"
    hand_on_network "$system"
    { chroot "$system" apt-get update -q &&
        chroot "$system" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $packages; } \
        >>"$system.log" 2>&1 || { tail -n 20 "$system.log" >&2; return 1; }

    mkdir -p "$system/srv/tlsplan"
    git clone --quiet --no-hardlinks "$repository" "$system/srv/tlsplan"
    if [ -d "$repository/../shared" ]; then
        mkdir "$system/srv/shared"
        mount --bind -o ro "$repository/../shared" "$system/srv/shared"
    fi

    mapfile -t environment < <(env | grep -E "$passed" | grep -v '^PIP_FIND_LINKS=/' || true)
    echo "$suite: $(run_there "$system" python3 --version), node $(run_there "$system" node --version)"
    for target in $targets; do
        began=$SECONDS
        if run_there "$system" make "$target" >"$system.$target.log" 2>&1 </dev/null; then
            echo "$suite: make $target passed, $((SECONDS - began)) s"
        else
            echo "$suite: make $target FAILED, $((SECONDS - began)) s; its last lines:"
            tail -n 40 "$system.$target.log"
            failed=1
        fi
        (cd "$system/srv/tlsplan" && du -sm .venv viewer_web/node_modules requirements/node/node_modules 2>/dev/null) |
            sed "s/^/$suite: MB after it: /" || true
    done
    return $failed
}

run_there() {
    local system=$1
    shift
    chroot "$system" env -i "${environment[@]}" HOME=/root LANG=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        sh -c 'cd /srv/tlsplan && exec "$@"' sh "$@"
}

# The host's way to apt, pip and npm: name servers, certificates, and configuration files.
hand_on_network() {
    local system=$1 file
    cp -L /etc/resolv.conf /etc/hosts "$system/etc/"
    apt-config dump | grep -E '^Acquire::(http|https|Check-)' >"$system/etc/apt/apt.conf.d/99host" || true
    if compgen -G "/usr/local/share/ca-certificates/*.crt" >/dev/null; then
        cp /usr/local/share/ca-certificates/*.crt "$system/usr/local/share/ca-certificates/"
        chroot "$system" update-ca-certificates >>"$system.log" 2>&1 || { tail -n 20 "$system.log" >&2; return 1; }
    fi
    for file in /etc/pip.conf /etc/npmrc ~/.npmrc ~/.pip/pip.conf ~/.config/pip/pip.conf; do
        [ -f "$file" ] || continue
        case $file in /etc/*) set -- "$system$file" ;; *) set -- "$system/root"/"${file#"$HOME"/}" ;; esac
        mkdir -p "$(dirname "$1")" && cp "$file" "$1"
    done
}

if [ "${1:-}" = --inside ]; then
    shift
    inside "$@"
    exit
fi

keep="" targets="demo test-wheel test" suites=()
while [ $# -gt 0 ]; do
    case $1 in
    --keep) keep=yes ;;
    --targets) targets=${2:?--targets needs a value} && shift ;;
    -*) echo "tests/bare_systems/run.sh: unknown option $1; see its head" >&2 && exit 2 ;;
    *) suites+=("$1") ;;
    esac
    shift
done
[ ${#suites[@]} -gt 0 ] || suites=(bookworm trixie)
[ "$(id -u)" = 0 ] || { echo "tests/bare_systems/run.sh: only root may make such systems" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "tests/bare_systems/run.sh: debootstrap is missing; apt-get install debootstrap" >&2; exit 1; }
[ -z "$(git -C "$repository" status --porcelain)" ] || echo "tests/bare_systems/run.sh: what is not committed is left out" >&2
if [ -z "${MIRROR:-}" ] && grep -q '^ID=debian$' /etc/os-release; then
    MIRROR=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | grep -v security | head -n 1)
fi
export MIRROR

folder=$(mktemp -d "${TMPDIR:-/tmp}/tlsplan-bare-XXXXXX")
[ -n "$keep" ] && echo "systems and logs: $folder" || trap 'rm -rf --one-file-system "$folder"' EXIT
status=0
for suite in "${suites[@]}"; do
    unshare --mount --propagation private --pid --fork --kill-child bash "$0" --inside "$suite" "$folder/$suite" "$targets" || status=1
    [ -n "$keep" ] || rm -rf --one-file-system "$folder/$suite"
done
exit $status
