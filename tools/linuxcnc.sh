#!/bin/sh
# LinuxCNC's rs274, which reads G-code as its machines do: sh tools/linuxcnc.sh FOLDER
#
# From two Debian packages, unpacked into the folder and not installed. Where they cannot be had it
# says why, and the test that needs them is passed over with that word; nothing else fails.

folder=$1
missing() {
    printf 'rs274: %s; G-code goes without its judge\n' "$1" >&2
    exit 0
}

[ -x "$folder/usr/bin/rs274" ] && exit 0
command -v apt-get >/dev/null && command -v dpkg >/dev/null || missing 'no apt-get and dpkg here'
mkdir -p "$folder" && cd "$folder" || missing "$folder cannot be made"
for package in linuxcnc-uspace libboost-python1.74.0; do
    apt-get download "$package" >apt.log 2>&1 || missing "apt-get download $package failed, see $folder/apt.log"
done
for file in ./*.deb; do
    dpkg -x "$file" . || missing "$file cannot be unpacked"
done
rm -f ./*.deb
