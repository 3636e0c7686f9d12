#!/bin/sh
# systemd-run, for a system that systemd does not run: what follows its options runs by itself.

while [ "${1#-}" != "$1" ]; do shift; done
echo "$*" >>/run/systemd-run.log
setsid "$@" </dev/null >/run/watch.log 2>&1 9>&- &
