#!/bin/sh
# systemctl, for a system that systemd does not run. Units that run are the lines of /run/units; every
# call is noted in /run/systemctl.log. A robot's unit runs the robot on its doubles.

units=/run/units
touch "$units"
echo "$*" >>/run/systemctl.log

start() {
	grep -qx "$1" "$units" && return
	case $1 in
	firmware-runtime@*)
		board=${1#*@}
		board=${board%.service}
		mkdir -p /run/firmware-runtime
		setsid /opt/firmware-runtime/venv/bin/firmware-runtime run \
			"/etc/firmware-runtime/$board.toml" --doubles --for 600 \
			</dev/null >/run/robot.log 2>&1 &
		echo $! >"/run/$1.pid"
		;;
	esac
	echo "$1" >>"$units"
}

stop() {
	if [ -e "/run/$1.pid" ]; then
		kill "$(cat "/run/$1.pid")"
		timeout 20 tail --pid="$(cat "/run/$1.pid")" -f /dev/null
		rm "/run/$1.pid"
	fi
	sed -i "/^$1\$/d" "$units"
}

verb=$1
shift
now=
for word in "$@"; do
	case $word in
	--now) now=yes ;;
	-*) ;;
	*)
		case $verb$now in
		start | enableyes) start "$word" ;;
		stop | disableyes) stop "$word" ;;
		show) if grep -qx "$word" "$units"; then echo ActiveState=active; else echo ActiveState=inactive; fi ;;
		esac
		;;
	esac
done
if [ "$verb" = list-units ]; then
	sed 's/$/ loaded active running/' "$units"
fi
