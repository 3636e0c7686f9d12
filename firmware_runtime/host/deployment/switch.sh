# Puts a new program in the place of the old: sh -s -- ROOT VENV BOARD START.
# Robots that run are stopped first, and run again afterwards if START is yes. With a ROOT files are
# written below it, and systemd is left alone.

set -u
umask 022
# What was begun is finished, even after the connection is lost: so nothing is printed before the end.
trap '' HUP PIPE

main() {
	root=${1%/} venv=$2 board=$3 start=$4
	home=$root/opt/firmware-runtime
	settings=$root/etc/firmware-runtime
	program=$home/venv/bin/firmware-runtime
	[ -d "$venv" ] || fail "$venv is gone; deploy again"
	is_whole "$venv" || fail "$venv: files are missing or were changed since it was made; deploy again"
	safe_program=$(sound_venv "$home/venv" "$venv")/bin/firmware-runtime
	running=
	if [ -z "$root" ]; then running=$(list_units); fi

	# shellcheck disable=SC2086 # one word a unit
	stop_units 'a new version' $running ||
		fail "a robot could not be made safe, so the old program stays;" \
			"cut the power of its motors, then deploy again"
	before=$(readlink "$home/venv")
	{ use_new_venv "$venv" && link_program && take_settings && install_service; } || go_back
	# shellcheck disable=SC2086
	if [ "$start" = yes ]; then start_units $running; fi
	remove_other_venvs
	sync # also what systemd has written
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
	kept=
	brought=$home/parcel/settings/$board.toml
	there=$settings/$board.toml
	[ -e "$brought" ] || return 0
	mkdir -p "$settings"
	if [ -e "$there" ] && ! cmp -s "$brought" "$there"; then
		copy "$there" "$there.previous" || return
		kept=$there.previous
	fi
	copy "$brought" "$there"
}

copy() { # file $1 to $2, which is whole at any time: the one from before or this
	cp -p "$1" "$2.new" && chmod 644 "$2.new" && sync "$2.new" && mv "$2.new" "$2"
}

go_back() { # to the program from before; without one, what was installed stays for inspection
	[ -n "$before" ] || fail "the service does not run; see firmware-runtime service logs $board"
	use_venv "$before"
	if [ -n "${kept:-}" ]; then copy "$kept" "$there"; fi
	if [ -z "$root" ]; then
		systemctl stop "firmware-runtime@$board.service"
		# shellcheck disable=SC2086
		start_units $running
	fi
	rm -rf "$venv"
	fail "the service does not run with the new program; the one from before is back"
}

fail() {
	echo "$*" >&2
	exit 1
}

printed=$(mktemp -d)
(main "$@") </dev/null >"$printed/out" 2>"$printed/err"
status=$?
cat "$printed/out"
cat "$printed/err" >&2
rm -rf "$printed"
[ "$status" -eq 0 ]
