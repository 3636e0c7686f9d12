# Stopping and starting robots that systemd runs.
# What makes them safe is $safe_program, the boards' settings are in $settings.

stop_units() { # for reason $1 the units that follow, which run; guards last
	# Fails if a board that ran cannot be made safe: then its guard goes on, and goes on trying.
	reason=$1
	shift
	guards=$(printf '%s\n' "$@" | sed -n '/^firmware-runtime-guard@/p')
	others=$(printf '%s\n' "$@" | sed '/^firmware-runtime-guard@/d')
	stop_all "$others" || return
	for unit in $others; do
		case $unit in
		firmware-runtime@*)
			# ExecStopPost has done so already, but its result was not checked.
			"$safe_program" safe-state "$settings/$(board_of "$unit").toml" --reason "$reason" || return
			;;
		esac
	done
	stop_all "$guards"
}

stop_all() { # the units in $1, together, if there are any
	[ -n "$1" ] || return 0
	# shellcheck disable=SC2086 # one word a unit
	systemctl stop $1
}

start_units() { # $@; one that does not start is reported and keeps no other from starting
	for unit in "$@"; do
		systemctl start "$unit" ||
			echo "firmware-runtime: $unit did not start; see journalctl --unit $unit" >&2
	done
}
