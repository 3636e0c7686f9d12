# Before the program goes or is replaced: stops robots and sees to it that they stand still.
#
# A robot that ran until now has answered until now. If it cannot be switched off, something is wrong
# with it while its motors may turn, and the one program that can switch them off must stay: this
# script fails. The person cuts the power and tries again; then the robot no longer runs.
# A robot that did not run is switched off too, in case it was driven by hand. Failing to do so is
# reported and no more: its power may be off, or its chips long gone, and the package could never be
# removed.

case $1 in
upgrade | remove | deconfigure)
	running=
	if [ -d /run/systemd/system ]; then running=$(list_units); fi
	# What a try before this one has stopped is to run again as well.
	if [ -n "$running" ]; then echo "$running" >>"$stopped"; fi
	reason="the package: $1"
	# shellcheck disable=SC2086 # one word a unit
	stop_units "$reason" $running || {
		echo "firmware-runtime: a robot could not be made safe, so the program stays;" \
			"cut the power of its motors, then repeat this" >&2
		exit 1
	}
	for board in $(installed_boards); do
		case " $(echo "$running" | tr '\n' ' ')" in
		*" firmware-runtime@$board.service "*) continue ;;
		esac
		"$program" safe-state "$settings/$board.toml" --reason "$reason" ||
			echo "firmware-runtime: $board did not run and does not answer; make sure it stands" >&2
	done
	if [ "$1" = remove ]; then
		for board in $(installed_boards); do
			"$program" service uninstall "$board" ||
				echo "firmware-runtime: the units of $board stay; a purge removes them" >&2
		done
		rm -f "$stopped"
	fi
	;;
failed-upgrade)
	# The version before has refused to go; a newer one knows no better.
	exit 1
	;;
esac
