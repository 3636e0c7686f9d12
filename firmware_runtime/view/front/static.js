"use strict";
/* A page that holds its data. */
renderPage(JSON.parse(document.getElementById("data").textContent).page);
document.body.dataset.ready = "true";
