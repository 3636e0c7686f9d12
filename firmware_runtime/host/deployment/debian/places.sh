# Where a package's installation lies, for the scripts that follow.

# shellcheck disable=SC2034 # each script uses some of these
{
	home=/opt/firmware-runtime
	settings=/etc/firmware-runtime
	records=/var/lib/firmware-runtime
	units=/etc/systemd/system
	program=$home/venv/bin/firmware-runtime
	stopped=/run/firmware-runtime.stopped # units to be started after an upgrade
}

installed_boards() { # those with a service
	for place in "$units"/firmware-runtime@*.service.d; do
		[ -d "$place" ] || continue
		board=${place##*@}
		echo "${board%.service.d}"
	done
}
