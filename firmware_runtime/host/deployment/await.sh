# Waits for the verdict on an update, SECONDS at most: sh -s -- SECONDS.
# Asked here and not by a login a second, which takes a slow computer more than the robot that is tried.

home=/opt/firmware-runtime
left=$1
while [ "$left" -gt 0 ]; do
	case $(field state) in
	staged | trying) ;;
	*) break ;;
	esac
	sleep 1
	left=$((left - 1))
done
