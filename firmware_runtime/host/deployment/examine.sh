# Has a new program examine the machine and the board: sh -s -- VENV BOARD FORCE.
# A program that does not pass is removed. Ends with the doctor's status, or 1 where check fails.

main() {
	venv=$1 board=$2 force=$3
	program=$venv/bin/firmware-runtime
	"$program" check "$board" || discard 1
	health=0
	"$program" doctor "$board" || health=$?
	case $health in
	0 | 7) ;;
	*) [ "$force" = yes ] || discard "$health" ;;
	esac
}

discard() {
	rm -rf "$venv"
	exit "$1"
}

main "$@" </dev/null
