# Signatures of versions: the list of what was sent, with its sums, is signed by an ssh key.

may_run() { # whether list $1 is signed by one whom this computer allows; where it asks for none, any
	signers=$root/etc/firmware-runtime/allowed_signers
	[ -e "$signers" ] || return 0
	ssh-keygen -Y find-principals -s "$1.sig" -f "$signers" 2>/dev/null | tr ',' '\n' |
		while read -r signer; do
			ssh-keygen -Y verify -n firmware-runtime -I "$signer" -f "$signers" -s "$1.sig" \
				<"$1" 2>/dev/null
		done | grep -q '^Good '
}
