# Makes a virtual environment beside the one in use: sh -s -- ROOT PYTHON [PACKAGE...].
# Beside the program it has these packages. Prints its folder.

umask 022 # the service's user reads it

main() {
	home=${1%/}/opt/firmware-runtime
	python=$2
	shift 2
	make_venv "$home/parcel/wheels" "$python" "$@" >&2 || exit 1
	echo "$made"
}

main "$@" </dev/null
