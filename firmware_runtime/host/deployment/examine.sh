# Has a program examine the machine and the board: sh -s -- VENV BOARD FORCE.
# One that does not pass is removed, unless it has been in use. Ends with the doctor's status, or 1
# where check fails.

main() {
	venv=$1 board=$2 force=$3
	home=${venv%/*}
	program=$venv/bin/firmware-runtime
	"$program" check "$board" || refuse 1
	health=0
	"$program" doctor "$board" || health=$?
	case $health in
	0 | 7) ;;
	*) [ "$force" = yes ] || refuse "$health" ;;
	esac
}

refuse() {
	discard_venv "$venv"
	exit "$1"
}

main "$@" </dev/null
