# Virtual environments in $home.
#
# Each is a folder venv.XXXXXX; the link `venv` names the one in use, `previous` the one before. A
# link is replaced in one step, and only by a program that is whole on the disk: so there is never
# half a program, also not after a power cut. What a program consists of is in its file `manifest`.

make_venv() { # from $2 with the wheels in $1, and the packages that follow; its folder is then $made
	wheels=$1 python=$2
	shift 2
	made=$(mktemp -d "$home/venv.XXXXXX") || return
	chmod 755 "$made"
	# What the system has and what suffices is taken from there: rclpy needs the numpy it was built
	# with. Everything else comes from the wheels, nothing from the network.
	"$python" -m venv --system-site-packages "$made" &&
		"$made/bin/python" -m pip --isolated --quiet --disable-pip-version-check install \
			--no-index --find-links "$wheels" 'firmware-runtime[gpio,metrics,top,completion]' "$@" &&
		write_manifest "$made" && return
	rm -rf "$made"
	return 1
}

write_manifest() { # of the files of $1, when all of them are on the disk
	(
		cd "$1" || exit
		sync -f . && find . -type f ! -path './manifest*' -exec sha256sum {} + >manifest.new &&
			sync -f . && mv manifest.new manifest && sync -f .
	)
}

is_whole() { # whether each file of $1 is there, as it was made
	(cd "$1" && sha256sum --check --strict --quiet manifest) >/dev/null 2>&1
}

sound_venv() { # $1, or $2 if that is not whole
	# One that was made before there were manifests has none. A damaged one makes no robot safe, and a
	# shell takes an empty file for a program that succeeds.
	if [ -s "$1/bin/firmware-runtime" ] && { [ ! -e "$1/manifest" ] || is_whole "$1"; }; then
		echo "$1"
	else
		echo "$2"
	fi
}

safe_venv() { # as sound_venv, of a program that runs: its interpreter may have gone
	each=$(sound_venv "$1" "$2")
	if "$each/bin/firmware-runtime" --version >/dev/null 2>&1; then echo "$each"; else echo "$2"; fi
}

use_venv() { # the link `venv` names $1 from now on
	ln -sfn "$1" "$home/venv.link" && sync -f "$home" &&
		mv -T "$home/venv.link" "$home/venv" && sync -f "$home"
}

use_new_venv() { # as use_venv, and the one in use becomes `previous`
	if [ -L "$home/venv" ]; then
		ln -sfn "$(readlink "$home/venv")" "$home/previous" || return
	fi
	use_venv "$1"
}

remove_other_venvs() { # all but those in use and before
	used=$(readlink -f "$home/venv") kept=$(readlink -f "$home/previous")
	for each in "$home"/venv.??????; do
		case $(readlink -f "$each") in
		"$used" | "$kept") ;;
		*) rm -rf "$each" ;;
		esac
	done
}
