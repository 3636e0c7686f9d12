# After the files have gone: removes what the program's installation made; with a purge, settings and
# whatever `service install` left.

case $1 in
remove)
	rm -rf "$home"
	;;
purge)
	rm -rf "$home" "$settings" "$records" /run/firmware-runtime "$stopped"
	for unit in firmware-runtime firmware-runtime-guard firmware-runtime-metrics \
		firmware-runtime-record firmware-runtime-bridge; do
		rm -rf "$units/$unit"@*
		rm -f "$units"/*.wants/"$unit"@*
	done
	rm -f /etc/sysusers.d/firmware-runtime.conf /etc/tmpfiles.d/firmware-runtime.conf \
		/etc/udev/rules.d/60-firmware-runtime.rules
	if [ -d /run/systemd/system ]; then systemctl daemon-reload || true; fi
	;;
esac
