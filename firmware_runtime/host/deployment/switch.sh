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
	[ -x "$venv/bin/firmware-runtime" ] || fail "$venv is gone; deploy again"
	running=
	if [ -z "$root" ]; then running=$(list_units); fi

	# shellcheck disable=SC2086 # one word a unit
	stop_units 'a new version' $running ||
		fail "a robot could not be made safe, so the old program stays;" \
			"cut the power of its motors, then deploy again"
	before=$(readlink "$home/venv")
	{ use_new_venv "$venv" && take_settings && install_service; } || go_back
	mkdir -p "$root/usr/local/bin"
	ln -sfn "$program" "$root/usr/local/bin/firmware-runtime"
	# shellcheck disable=SC2086
	if [ "$start" = yes ]; then start_units $running; fi
	remove_other_venvs
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
		cp -p "$there" "$there.previous" || return
		kept=$there.previous
	fi
	install -m 644 "$brought" "$there"
}

go_back() { # to the program from before; without one, what was installed stays for inspection
	[ -n "$before" ] || fail "the service does not run; see firmware-runtime service logs $board"
	use_venv "$before"
	if [ -n "${kept:-}" ]; then cp -p "$kept" "$there"; fi
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
