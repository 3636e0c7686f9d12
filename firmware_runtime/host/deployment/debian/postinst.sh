# After unpacking: makes the program from the wheels, and starts what an upgrade has stopped.

umask 022

case $1 in
configure)
	mkdir -p "$home"
	make_venv /usr/share/firmware-runtime/wheels /usr/bin/python3 || {
		echo "firmware-runtime: no virtual environment; robots that ran are stopped" >&2
		exit 1
	}
	use_venv "$made"
	rm -f "$home/previous"
	remove_other_venvs
	if [ -d /run/systemd/system ]; then
		for board in $(installed_boards); do
			# Its units as this version has them. One that was disabled stays disabled.
			systemctl is-enabled --quiet "firmware-runtime@$board.service" || continue
			"$program" service install "$board" --no-start --program "$program" ||
				echo "firmware-runtime: the units of $board are as they were" >&2
		done
		if [ -s "$stopped" ]; then
			# shellcheck disable=SC2046 # one word a unit
			start_units $(cat "$stopped")
		fi
	fi
	rm -f "$stopped"
	;;
abort-upgrade | abort-remove | abort-deconfigure)
	# A robot that could not be made safe is one reason to be here.
	if [ -s "$stopped" ]; then
		robots=$(sed '/-guard@/d' "$stopped" | tr '\n' ' ')
		echo "firmware-runtime: these are stopped and stay so: $robots" >&2
	fi
	;;
esac
