# An update and the way back. How far it has come is in $home/update, on the disk before each step:
#
#   staged --robots stopped--> trying --it is healthy--> committed
#   staged, trying --not healthy, no verdict in time, the computer restarted--> reverted
#
# A first version has none to go back to: what would be reverted is `unproved`, and stays.
# As /opt/firmware-runtime/update.sh, with venvs.sh, units.sh and robots.sh before it, this is also what
# takes a version back: sh update.sh boot | watch SECONDS VENV | status SECONDS. To go back needs neither of the
# two programs.

set_state() { # $1, because of $2
	case $1 in
	staged | trying) ;;
	*) rm -f "$home/reserve" ;; # the disk may be full
	esac
	running=$(echo "$running" | tr '\n' ' ')
	{
		printf '%s\n' "state $1" "board $board" "new $venv" "old $before" "earlier $earlier" \
			"running $running" "since $(date -u +%Y-%m-%dT%H:%M:%SZ)" "reason $2"
	} >"$home/update.new" && sync "$home/update.new" &&
		mv "$home/update.new" "$home/update" && sync -f "$home"
}

field() { # of the update, by its name
	sed -n "s/^$1 \{1,\}//p" "$home/update" 2>/dev/null
}

read_state() { # what `set_state` wrote
	board=$(field board) venv=$(field new) before=$(field old) earlier=$(field earlier)
	running=$(field running)
}

of_system() { # what a version puts beside its program, as paths below $root; not the way back itself
	(
		cd "${root:-/}" || exit
		for each in etc/systemd/system/firmware-runtime* etc/systemd/system/*.wants/firmware-runtime* \
			etc/sysusers.d/firmware-runtime.conf etc/tmpfiles.d/firmware-runtime.conf \
			etc/udev/rules.d/60-firmware-runtime.rules "etc/firmware-runtime/$board.toml"; do
			case $each in
			*/firmware-runtime-update.service) ;;
			*) find "$each" ! -type d 2>/dev/null ;;
			esac
		done
	)
}

keep_system() { # of the version in use
	of_system | tar -C "${root:-/}" -cf "$home/before.tar.new" -T - &&
		sync "$home/before.tar.new" && mv "$home/before.tar.new" "$home/before.tar" && sync -f "$home"
}

reserve_room() { # for what is written to come back; what does not compress takes its room
	head -c 4194304 /dev/urandom >"$home/reserve" && sync "$home/reserve" && return
	rm -f "$home/reserve"
	return 1
}

restore_system() { # as it was kept; what came since goes
	kept_names=$(tar -tf "$home/before.tar") || return
	of_system | while read -r each; do
		printf '%s\n' "$kept_names" | grep -qxF -e "$each" || rm -rf "${root:-/}/$each"
	done
	tar -C "${root:-/}" -xf "$home/before.tar" && sync
}

take_back() { # the version in use, because of $1, while no robot runs
	if [ -z "$before" ] || [ "$(sound_venv "$before" "$venv")" != "$before" ]; then
		set_state unproved "$1; there is no whole version before it"
		return 1
	fi
	rm -f "$home/reserve"
	use_venv "$before" || return
	if [ -n "$earlier" ]; then ln -sfn "$earlier" "$home/previous"; else rm -f "$home/previous"; fi
	# Nothing slow comes between the link and what belongs to it; without room the new version goes first.
	restore_system || { discard_venv "$venv"; restore_system; } || {
		set_state trying "$1; units and settings from before could not be written"
		return 0 # robots run, and the next start of the computer tries again
	}
	set_state reverted "$1" || return
	discard_venv "$venv" || : # what is left of it harms nothing
}

revert() { # as take_back, and the robots that ran run again; those of the new version are stopped
	safe_program=$(safe_venv "$before" "$venv")/bin/firmware-runtime
	# shellcheck disable=SC2086 # one word a unit
	{ now=$(list_units) && stop_units 'an update is taken back' $now; } || {
		set_state trying "$1; a robot could not be made safe: cut the power of its motors"
		return 1
	}
	take_back "$1" || return
	systemctl daemon-reload
	# shellcheck disable=SC2086 # one word a unit
	start_units $running
}

boot() { # before any robot is started
	exec 9>"$home/update.lock"
	flock --nonblock 9 || return 0 # it is being tried: the computer has not restarted
	case $(field state) in
	staged | trying)
		read_state
		take_back "the computer restarted before the new version had proved itself" ||
			[ "$(field state)" = unproved ] || return
		systemctl daemon-reload
		;;
	esac
}

watch() { # for $1 seconds, over the version in $2; what does not end well, or in time, is taken back
	seconds=$1
	exec 9>"$home/update.lock"
	flock 9
	read_state
	[ "$(field state)" = trying ] && [ "$venv" = "$2" ] || return 0
	last="this version cannot tell its health; its services run"
	healthy=0
	if "$venv/bin/firmware-runtime" service health --help >/dev/null 2>&1; then
		said=$(timeout --kill-after=5 "$((seconds + 120))" "$venv/bin/firmware-runtime" service health \
			"$board" --for "$seconds" --before "$home/before.json" 2>&1)
		healthy=$?
		last=$(printf '%s\n' "$said" | tail -n 1 | sed 's/^firmware-runtime: //')
	else
		sleep "$seconds"
	fi
	if [ "$healthy" = 0 ]; then
		for unit in $running; do
			systemctl is-active --quiet "$unit" || healthy=6 last="$unit does not run"
		done
	fi
	case $healthy in
	0) set_state committed "$last" && remove_other_venvs ;;
	124 | 137) revert "no verdict on its health within $((seconds + 120)) s" ;;
	*) revert "${last:-its health could not be told (status $healthy)}" ;;
	esac
}

status() { # the versions there are, and how the last update stands, at the latest after $1 seconds
	left=${1:-0}
	while [ "$left" -gt 0 ]; do
		case $(field state) in
		staged | trying) sleep 1 ;;
		*) break ;;
		esac
		left=$((left - 1))
	done
	list_versions | sed 's/^/version /'
	cat "$home/update" 2>/dev/null || echo "state none"
}
