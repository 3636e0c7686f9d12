# Puts another program in the place of the one in use: sh -s -- ROOT VENV BOARD START HEALTH WHENCE.
# WHENCE is `sent`, with its settings and its way back, or `kept` for one that was in use before.
# Robots that run are stopped first, and run again afterwards if START is yes; then the new version is
# tried for HEALTH seconds, and taken back where it does not prove itself. With a ROOT files are
# written below it, and systemd is left alone.

set -u
umask 022
# What was begun is finished, even after the connection is lost: so nothing is printed before the end.
trap '' HUP PIPE

main() {
	root=${1%/} venv=$2 board=$3 start=$4 health=$5 whence=$6
	home=$root/opt/firmware-runtime
	settings=$root/etc/firmware-runtime
	program=$home/venv/bin/firmware-runtime
	exec 9>"$home/update.lock"
	flock --nonblock 9 || refuse "an update is being tried; see firmware-runtime deploy status"
	[ -d "$venv" ] || fail "$venv is gone; deploy again"
	is_whole "$venv" || refuse "$venv: files are missing or were changed since it was made; deploy again"
	may_run "$venv/manifest" ||
		refuse "$venv is not signed by a key of $settings/allowed_signers"
	running=
	if [ -z "$root" ]; then running=$(list_units) || refuse "systemd does not say what runs"; fi
	safe_program=$(safe_venv "$home/venv" "$venv")/bin/firmware-runtime
	# shellcheck disable=SC2086 # one word a unit
	armed=$(armed_among "$safe_program" $running)
	[ -z "$armed" ] || refuse "$armed is armed, expected it disarmed: firmware-runtime disarm $armed"
	if [ -z "$root" ] && [ "$(field state)" = trying ]; then
		read_state
		revert "nobody waited for its verdict any more" || [ "$(field state)" = unproved ] ||
			fail "$(field reason)"
		venv=$2 board=$3
		running=$(list_units) || fail "systemd does not say what runs"
		safe_program=$(safe_venv "$home/venv" "$venv")/bin/firmware-runtime
	fi
	before=$(readlink "$home/venv")
	earlier=$(readlink "$home/previous")

	{ reserve_room && keep_system && keep_figures && keep_way_back && set_state staged "it is whole"; } ||
		refuse "the way back could not be prepared, so the old program stays"
	# shellcheck disable=SC2086
	stop_units 'a new version' $running || {
		set_state reverted "a robot could not be made safe"
		fail "a robot could not be made safe, so the old program stays;" \
			"cut the power of its motors, then deploy again"
	}
	{ set_state trying "its health is not known yet" && start_watch && use_new_venv "$venv" &&
		link_program && take_settings && install_service; } || go_back
	if is_tried; then
		# shellcheck disable=SC2086
		start_units $running
	else
		{ set_state committed "it was not started, so not tried" && remove_other_venvs; } || go_back
	fi
	sync # also what systemd has written
}

is_tried() { # whether this version runs now
	[ -z "$root" ] && [ "$start" = yes ]
}

start_watch() { # it waits for the lock, which is free when this script ends, however it ends
	is_tried || return 0
	systemd-run --quiet --collect --unit=firmware-runtime-watch --property=Restart=on-abnormal \
		--property=OOMScoreAdjust=-900 /bin/sh "$home/update.sh" watch "$health" "$venv"
}

keep_figures() { # of the version in use, to compare with
	"$program" stats "$board" --json >"$home/before.json" 2>/dev/null || rm -f "$home/before.json"
}

keep_way_back() { # what takes a version back, as this version does it, and the unit that starts it
	[ "$whence" = sent ] || { [ -s "$home/update.sh" ] && return; } # the newest there is
	scripts=$venv/deployment/scripts
	cat "$scripts/venvs.sh" "$scripts/units.sh" "$scripts/robots.sh" "$scripts/update.sh" \
		"$scripts/persisted.sh" >"$home/update.sh.new" &&
		sync "$home/update.sh.new" && mv "$home/update.sh.new" "$home/update.sh" || return
	units=$root/etc/systemd/system
	mkdir -p "$units/basic.target.wants" &&
		copy "$scripts/firmware-runtime-update.service" \
			"$units/firmware-runtime-update.service" &&
		ln -sfn ../firmware-runtime-update.service \
			"$units/basic.target.wants/firmware-runtime-update.service" && sync -f "$units"
}

link_program() {
	mkdir -p "$root/usr/local/bin" && ln -sfn "$program" "$root/usr/local/bin/firmware-runtime"
}

install_service() {
	set -- service install "$board"
	if [ -n "$root" ]; then
		set -- "$@" --root "$root"
	else
		# By the link, which stays when the folder behind it is another one.
		set -- "$@" --program "$program"
	fi
	if [ "$start" = no ]; then set -- "$@" --no-start; fi
	"$program" "$@"
}

take_settings() { # those that came along, if any; those before are kept beside them
	brought=$venv/deployment/settings/$board.toml
	there=$settings/$board.toml
	[ "$whence" = sent ] && [ -e "$brought" ] || return 0
	mkdir -p "$settings"
	if [ -e "$there" ] && ! cmp -s "$brought" "$there"; then
		copy "$there" "$there.previous" || return
	fi
	copy "$brought" "$there"
}

copy() { # file $1 to $2, which is whole at any time: the one from before or this
	cp -p "$1" "$2.new" && chmod 644 "$2.new" && sync "$2.new" && mv "$2.new" "$2"
}

go_back() { # to the program from before; without one, what was installed stays for inspection
	if [ -z "$root" ]; then
		revert "its service did not start"
	else
		take_back "its service was not installed"
	fi
	[ "$(field state)" != trying ] || fail "$(field reason)"
	[ "$(field state)" = reverted ] ||
		fail "the service does not run; see firmware-runtime service logs $board"
	fail "the service does not run with the new program; the one from before is back"
}

refuse() { # before anything was begun
	discard_venv "$venv"
	fail "$@"
}

fail() {
	echo "$*" >&2
	exit 1
}

printed=$(mktemp -d) || exit
exec 3>"$printed/out" 5>"$printed/err" || exit
exec 4<"$printed/out" 6<"$printed/err" || exit
rm -rf "$printed" # its files are there until this ends, however that is
(main "$@") </dev/null >&3 2>&5 3>&- 4<&- 5>&- 6<&-
status=$?
cat <&4
cat <&6 >&2
[ "$status" -eq 0 ]
