#!/bin/sh
# The Debian package on a bare system: installs it there with apt, renders the sample capture, reconstructs it.
#
#   sh tests/package.sh BUILD BARE       as root; BUILD: a build folder; BARE: a bare Debian 12, as debootstrap
#                                        --variant=minbase makes it and ../shared/fresh.sh keeps in /var/tmp/bare-debian/system
set -eu
[ $# = 2 ] || { sed -n 2,6p "$0"; exit 2; }
build=$(realpath "$1")
run=$(mktemp -d /var/tmp/goniocam-package.XXXX)
leave() {
    for m in dev proc sys; do umount "$run/$m" 2>/dev/null || true; done
    rm -rf --one-file-system "$run"
}
trap leave EXIT
cp -a "$2/." "$run/"
cp /etc/resolv.conf "$run/etc/"
for m in proc sys dev; do mount --bind "/$m" "$run/$m"; done
(cd "$build" && rm -f ./*.deb && cpack >&2)
cp "$build"/goniocam_*.deb "$run/tmp/goniocam.deb"
chroot "$run" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 sh -euc '
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends /tmp/goniocam.deb >/dev/null
    cd /tmp
    goniocam --version
    goniocam render /usr/share/doc/goniocam/examples/plastic-ball.yaml -o ball --quiet
    goniocam reconstruct ball -o ball-brdf --quiet
    ls -l ball-brdf/brdf.binary'
echo "package: installed and reconstructs"
