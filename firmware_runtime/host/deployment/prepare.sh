# Makes a virtual environment beside the one in use: sh -s -- ROOT PYTHON. Prints its folder.

umask 022 # the service's user reads it

main() {
	home=${1%/}/opt/firmware-runtime
	make_venv "$home/parcel/wheels" "$2" >&2 || exit 1
	echo "$made"
}

main "$@" </dev/null
