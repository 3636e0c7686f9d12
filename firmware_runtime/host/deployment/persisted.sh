
umask 022
home=$(cd "$(dirname "$0")" && pwd) || exit
root=${home%/opt/firmware-runtime}
settings=$root/etc/firmware-runtime
case $1 in
boot | watch | status) "$@" ;;
*)
	echo "expected boot, watch SECONDS VENV or status SECONDS" >&2
	exit 2
	;;
esac
