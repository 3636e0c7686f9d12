# What a target has: sh -s -- ROOT PYTHON BOARD. Prints lines `key value`; changes nothing.
# What is not found is printed as an empty value.

nearest() { # the first folder on the way up from $1 that there is
	place=$1
	while [ ! -d "$place" ]; do place=$(dirname "$place"); done
	echo "$place"
}

main() {
	root=${1%/} python=$2 board=$3
	home=$root/opt/firmware-runtime

	echo "machine $(uname -m)"
	echo "python $("$python" -c 'import sys; print("%d.%d.%d" % sys.version_info[:3])' 2>/dev/null)"
	echo "bits $("$python" -c 'import sys; print(64 if sys.maxsize > 2**32 else 32)' 2>/dev/null)"
	echo "venv $("$python" -c 'import ensurepip, venv; print("yes")' 2>/dev/null)"
	echo "glibc $(getconf GNU_LIBC_VERSION 2>/dev/null | sed 's/^glibc //')"
	echo "rsync $(command -v rsync)"
	echo "free_kib $(df -Pk "$(nearest "$home")" | awk 'NR == 2 { print $4 }')"
	if [ "$(id -u)" = 0 ]; then
		echo "superuser root"
	elif sudo -n true 2>/dev/null; then
		echo "superuser sudo"
	else
		echo "superuser"
	fi
	if [ -w "$(nearest "$home")" ]; then echo "writable yes"; else echo "writable"; fi
	if [ -d /run/systemd/system ]; then echo "systemd yes"; else echo "systemd"; fi
	if [ -e "$home/venv" ] && [ ! -L "$home/venv" ]; then echo "foreign $home/venv"; else echo "foreign"; fi
	if [ -e "$root/etc/firmware-runtime/$board.toml" ]; then
		echo "settings $root/etc/firmware-runtime/$board.toml"
	else
		echo "settings"
	fi
	echo "kinds $(sed -n 's/^board *= *"\([^"]*\)".*/\1/p' "$root"/etc/firmware-runtime/*.toml \
		2>/dev/null | sort -u | tr '\n' ' ')"
}

main "$@" </dev/null
