# Virtual environments in $home.
#
# Each is a folder venv.XXXXXX; the link `venv` names the one in use, `previous` the one before. A
# link is replaced in one step, so there is never half a program.

make_venv() { # from $2 with the wheels in $1, and the packages that follow; its folder is then $made
	wheels=$1 python=$2
	shift 2
	made=$(mktemp -d "$home/venv.XXXXXX") || return
	chmod 755 "$made"
	# What the system has and what suffices is taken from there: rclpy needs the numpy it was built
	# with. Everything else comes from the wheels, nothing from the network.
	"$python" -m venv --system-site-packages "$made" &&
		"$made/bin/python" -m pip --isolated --quiet --disable-pip-version-check install \
			--no-index --find-links "$wheels" 'firmware-runtime[gpio,metrics,top,completion]' "$@" && return
	rm -rf "$made"
	return 1
}

use_venv() { # the link `venv` names $1 from now on
	ln -sfn "$1" "$home/venv.link" && mv -T "$home/venv.link" "$home/venv"
}

use_new_venv() { # as use_venv, and the one in use becomes `previous`
	if [ -L "$home/venv" ]; then
		ln -sfn "$(readlink "$home/venv")" "$home/previous" || return
	fi
	use_venv "$1"
}

remove_other_venvs() { # all but those in use and before
	for each in "$home"/venv.??????; do
		[ "$each" = "$(readlink "$home/venv")" ] ||
			[ "$each" = "$(readlink "$home/previous" || true)" ] ||
			rm -rf "$each"
	done
}
