# Units of this project that systemd runs.

list_units() { # of this project, that run now
	listed=$(systemctl list-units --plain --no-legend --full --state=active,activating,reloading \
		'firmware-runtime@*' 'firmware-runtime-*@*') || return
	printf '%s\n' "$listed" | awk '{ print $1 }'
}

board_of() { # the board of unit $1
	board=${1#*@}
	echo "${board%.service}"
}

armed_among() { # the boards whose run is armed, as program $1 says, of the units that follow
	asked=$1
	shift
	for unit in "$@"; do
		case $unit in
		firmware-runtime@*)
			figures=$("$asked" stats "$(board_of "$unit")" --json 2>/dev/null)
			case $figures in
			*'"state": "running"'*'"armed": true'*) board_of "$unit" ;;
			esac
			;;
		esac
	done
}
