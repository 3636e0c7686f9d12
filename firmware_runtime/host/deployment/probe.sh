# What a target has: sh -s -- ROOT PYTHON BOARD BROUGHT [NODE...]. Prints lines `key value`; changes
# nothing. What is not found is printed as an empty value. The nodes are the board's; with BROUGHT
# they count, and not those that its settings on the target name. Without a BOARD it is the one of the
# last update.

INTERPRETER='
import sys
from importlib.metadata import distributions
from importlib.util import MAGIC_NUMBER
print("base", getattr(sys, "_base_executable", "") or sys.executable)
print("magic", MAGIC_NUMBER.hex())
found = {each.metadata["Name"]: each.version for each in reversed([*distributions()])}
print("packages", *(f"{name}=={version}" for name, version in found.items()))
'

nearest() { # the first folder on the way up from $1 that there is
	place=$1
	while [ ! -d "$place" ]; do place=$(dirname "$place"); done
	echo "$place"
}

nodes_in() { # the device nodes that the file $1 names
	sed -n 's/^[^#"]*"\(\/dev\/[A-Za-z0-9_.,:+\/-]*\)".*/\1/p' "$1"
}

main() {
	root=${1%/} python=$2 brought=$4
	home=$root/opt/firmware-runtime
	board=${3:-$(sed -n 's/^board *//p' "$home/update" 2>/dev/null)}
	shift 4

	echo "machine $(uname -m)"
	echo "python $("$python" -c 'import sys; print("%d.%d.%d" % sys.version_info[:3])' 2>/dev/null)"
	echo "bits $("$python" -c 'import sys; print(64 if sys.maxsize > 2**32 else 32)' 2>/dev/null)"
	"$python" -I -c "$INTERPRETER" 2>/dev/null
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
	program=$home/venv/bin/firmware-runtime
	armed=
	if [ -z "$root" ] && [ -d /run/systemd/system ] && [ -s "$program" ]; then
		# shellcheck disable=SC2046 # one word a unit
		armed=$(armed_among "$program" $(list_units) | tr '\n' ' ')
	fi
	echo "armed $armed"
	echo "board $board"
	echo "versions $(list_versions | tr '\n' ';')"
	echo "signers $(ls "$root/etc/firmware-runtime/allowed_signers" 2>/dev/null)"
	if [ -e "$home/venv" ] && [ ! -L "$home/venv" ]; then echo "foreign $home/venv"; else echo "foreign"; fi
	if [ -e "$root/etc/firmware-runtime/$board.toml" ]; then
		echo "settings $root/etc/firmware-runtime/$board.toml"
		# shellcheck disable=SC2046 # one word a node
		[ "$brought" = yes ] || set -- $(nodes_in "$root/etc/firmware-runtime/$board.toml")
	else
		echo "settings"
	fi
	lacking=
	for node in "$@"; do [ -e "$node" ] || lacking="$lacking $node"; done
	echo "lacking$lacking"
	echo "kinds $(sed -n 's/^board *= *"\([^"]*\)".*/\1/p' "$root"/etc/firmware-runtime/*.toml \
		2>/dev/null | sort -u | tr '\n' ' ')"
}

main "$@" </dev/null
