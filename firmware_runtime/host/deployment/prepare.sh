# Makes a virtual environment of what was sent: sh -s -- ROOT VENV PYTHON COMPILED.
# Nothing of it is run before its signature is verified, where this computer asks for one.

umask 022 # the service's user reads it

main() {
	root=${1%/} venv=$2
	home=$root/opt/firmware-runtime
	may_run "$venv/manifest.sent" ||
		refuse "the new version is not signed by a key of $root/etc/firmware-runtime/allowed_signers"
	is_as_sent "$venv" || refuse "what arrived is not what was sent; deploy again"
	finish_venv "$venv" "$3" "$4" || refuse "the new version could not be written"
}

refuse() {
	rm -rf "$venv"
	echo "$*" >&2
	exit 1
}

main "$@" </dev/null
